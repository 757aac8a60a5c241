// SPDX-License-Identifier: Apache-2.0
#include "backend/smoother_state.h"

#include <algorithm>

#include "backend/factors/loose_odometry.h"

namespace ignis {

const GraphNode* SmootherState::node_of(std::int32_t id) const {
  const auto found = std::ranges::lower_bound(nodes, id, {}, [](const GraphNode& node) { return node.end.id; });
  return found != nodes.end() && found->end.id == id ? &*found : nullptr;
}

std::size_t SmootherState::place_of(std::int32_t id) const {
  return static_cast<std::size_t>(node_of(id) - nodes.data());
}

int keyframes_in(const SmootherState& state) { return static_cast<int>(state.nodes.size() + state.absorbed.size()); }

bool is_absorbed(std::int32_t id, const SmootherState& state) {
  return std::ranges::binary_search(state.absorbed, id, {}, &KeyframePose::id);
}

bool were_absorbed_between(std::int32_t earlier, std::int32_t later, const SmootherState& state) {
  const auto next = std::ranges::upper_bound(state.absorbed, earlier, {}, &KeyframePose::id);
  return next != state.absorbed.end() && next->id < later;
}

bool has_retired(std::int32_t id, const SmootherState& state) {
  const std::size_t retired = state.retired.count();
  return retired > 0 && id <= state.nodes[retired - 1].end.id;
}

void follow_nodes(SmootherState& state, const BackendConfig& config) {
  const WhiteningRows loose = loose_rows(config);
  const Matrix6d background = loose.transpose() * loose;
  for (std::size_t i = state.odometry.size(); i < state.nodes.size(); ++i) {
    const GraphNode& node = state.nodes[i];
    state.odometry.append(node.end.filter.T_odom_body, covariance_of(node.odometry, background), node.pose_covariance);
  }
  for (std::size_t i = 0; i < state.poses.size(); ++i) state.places.place(i, state.poses[i].T_map_body.translation);
}

}  // namespace ignis
