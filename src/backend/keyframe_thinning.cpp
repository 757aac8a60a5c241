// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframe_thinning.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "backend/information.h"
#include "backend/place_list.h"
#include "common/frames.h"

namespace ignis {
namespace {

// [rad] A keyframe that looks another way sees another part of the place.
constexpr double kSameHeading = std::numbers::pi / 4.0;
// [keyframes] Those of one pass stay, close as they may be: together they are the map that a loop is matched with.
constexpr std::int32_t kAnotherPass = 10;

double heading(const Pose& T_map_body) { return frames::to_yaw_pitch_roll(T_map_body.rotation).yaw; }

/// Ascending ids of the keyframes that loops in the graph, and verified ones outside of it, end at.
std::vector<std::int32_t> ends_of_loops(const SmootherState& state) {
  std::vector<std::int32_t> ids;
  for (const std::vector<GraphLoop>* loops : {&state.loops, &state.waiting}) {
    for (const GraphLoop& loop : *loops) ids.insert(ids.end(), {loop.result.from_id, loop.result.to_id});
  }
  std::ranges::sort(ids);
  return ids;
}

/// Whether the keyframe at `earlier` says what that at `later` would.
bool stands_for(const KeyframePose& earlier, const KeyframePose& later, const BackendConfig& config) {
  if (later.id - earlier.id < kAnotherPass) return false;
  const Pose& a = earlier.T_map_body;
  const Pose& b = later.T_map_body;
  if ((a.translation - b.translation).norm() > config.retired_spacing_m) return false;
  return std::abs(std::remainder(heading(a) - heading(b), 2.0 * std::numbers::pi)) <= kSameHeading;
}

/// Takes the places out of the blocks, and blocks of which nothing is left.
void shorten(std::vector<RetiredBlock>& blocks, std::span<const std::size_t> places) {
  std::size_t before = 0;
  std::erase_if(blocks, [&](RetiredBlock& block) {
    block.until -= static_cast<std::size_t>(std::ranges::lower_bound(places, block.until) - places.begin());
    const bool is_empty = block.until == before;
    before = block.until;
    return is_empty;
  });
}

/// What stays behind a gap is linked, in the exported graph, to what stays before it.
void link_across(std::span<const std::size_t> places, SmootherState& state) {
  std::optional<std::size_t> newest_staying;
  auto gone = places.begin();
  for (std::size_t i = 0; i < state.nodes.size() && i <= places.back() + 1; ++i) {
    if (gone != places.end() && *gone == i) {
      ++gone;
      continue;
    }
    if (newest_staying && *newest_staying + 1 < i)
      state.nodes[i].odometry = whitening(state.odometry.covariance(*newest_staying, i).inverse());
    newest_staying = i;
  }
}

}  // namespace

std::vector<std::size_t> places_to_absorb(std::size_t until, const BackendConfig& config, const SmootherState& state) {
  if (config.retired_spacing_m <= 0.0) return {};
  if (const std::size_t recorded = state.clouds.recorded(); recorded > 0) until = std::min(until, recorded);
  const std::vector<std::int32_t> held = ends_of_loops(state);
  std::vector<std::size_t> found;
  std::vector<std::size_t> staying;
  PlaceIndex near(config.retired_spacing_m);  // numbers are indices of `staying`
  for (std::size_t i = 0; i < until; ++i) {
    const KeyframePose& pose = state.poses[i];
    const Eigen::Vector3d& position = pose.T_map_body.translation;
    const std::vector<std::size_t> around = near.around(position, config.retired_spacing_m);
    const bool is_held = std::ranges::binary_search(held, pose.id);
    if (!is_held && std::ranges::any_of(around, [&](std::size_t number) {
          return stands_for(state.poses[staying[number]], pose, config);
        })) {
      found.push_back(i);
      continue;
    }
    near.place(staying.size(), position);
    staying.push_back(i);
  }
  return found;
}

void absorb(std::span<const std::size_t> places, SmootherState& state) {
  if (places.empty()) return;
  link_across(places, state);
  erase_places(state.nodes, places);
  erase_places(state.poses, places);
  erase_places(state.published, places);
  state.clouds.erase(places);
  state.odometry.erase(places);
  state.places = PlaceIndex(SmootherState::kPlaceCell);
  for (std::size_t i = 0; i < state.poses.size(); ++i) state.places.place(i, state.poses[i].T_map_body.translation);
  shorten(state.retired.blocks, places);
  const std::size_t loops = state.retired.loops.size();
  std::erase_if(state.retired.loops, [&](const GraphLoop& loop) {
    return state.node_of(loop.result.from_id) == nullptr || state.node_of(loop.result.to_id) == nullptr;
  });
  state.absorbed_loops += static_cast<int>(loops - state.retired.loops.size());
}
}  // namespace ignis
