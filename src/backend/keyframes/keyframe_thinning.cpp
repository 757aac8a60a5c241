// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframes/keyframe_thinning.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "backend/factors/information.h"
#include "backend/keyframes/erase_places.h"
#include "common/frames.h"

namespace ignis {
namespace {

// [rad] A keyframe that looks another way sees another part of the place.
constexpr double kSameHeading = std::numbers::pi / 4.0;
// [keyframes] Those of one pass stay, close as they may be: together they are the map that a loop is matched with.
constexpr std::int32_t kAnotherPass = 10;

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
  const double turn = frames::to_yaw_pitch_roll(b.rotation).yaw - frames::to_yaw_pitch_roll(a.rotation).yaw;
  return std::abs(std::remainder(turn, 2.0 * std::numbers::pi)) <= kSameHeading;
}

/// Takes the places out of the blocks, and blocks of which nothing is left.
void shorten(std::vector<RetiredBlock>& blocks, std::span<const std::size_t> places) {
  std::vector<RetiredBlock> left;
  for (RetiredBlock& block : blocks) {
    block.until -= static_cast<std::size_t>(std::ranges::lower_bound(places, block.until) - places.begin());
    if (block.until > (left.empty() ? 0 : left.back().until)) left.push_back(block);
  }
  blocks = std::move(left);
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
    const auto stands = [&](std::size_t number) { return stands_for(state.poses[staying[number]], pose, config); };
    if (std::ranges::any_of(around, stands)) {
      // One that waits for its loops to retire must not stand for others meanwhile.
      if (!std::ranges::binary_search(held, pose.id)) found.push_back(i);
      continue;
    }
    near.place(staying.size(), position);
    staying.push_back(i);
  }
  return found;
}

int absorb(std::span<const std::size_t> places, std::span<const KeyframePose> poses, SmootherState& state) {
  if (places.empty()) return 0;
  state.absorbed.insert(state.absorbed.end(), poses.begin(), poses.end());
  std::ranges::sort(state.absorbed, {}, &KeyframePose::id);
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
  return static_cast<int>(loops - state.retired.loops.size());
}

}  // namespace ignis
