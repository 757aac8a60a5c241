// SPDX-License-Identifier: Apache-2.0
#include "map/live_map.h"

#include <algorithm>

namespace ignis {

ThreeLevelMap rebuild(const RebuildJob& job) {
  ThreeLevelMap map(job.config);
  map.replace_world(job.clouds, job.T_map_body);
  return map;
}

LiveMap::LiveMap(const MapConfig& config)
    : config_(config),
      map_(config),
      clouds_(config.local_cell_m, static_cast<std::size_t>(config.max_keyframe_points)) {}

InsertCounts LiveMap::insert_scan(std::span<const CloudPoint> points_body, const Pose& T_odom_body) {
  if (!usable(T_odom_body) || !usable(T_map_odom_ * T_odom_body)) {
    ++refused_poses_;
    return {.rejected = points_body.size()};
  }
  T_odom_body_ = T_odom_body;
  path_.add(T_odom_body.translation, nodes_.empty() ? -1 : nodes_.rbegin()->first);
  clouds_.add_scan(points_body, T_odom_body);
  if (rebuilding_) waiting_.push_back({{points_body.begin(), points_body.end()}, T_odom_body});
  return map_.insert(points_body, T_map_body());
}

bool LiveMap::add_keyframe(const Keyframe& keyframe) {
  const Pose& T_odom_keyframe = keyframe.state.T_odom_body;
  if (!usable(T_odom_keyframe) || !usable(T_map_odom_ * T_odom_keyframe)) {
    ++refused_poses_;
    return false;
  }
  Node& node = nodes_[keyframe.id];
  if (node.has_cloud) return true;
  node.has_cloud = true;
  node.T_odom_keyframe = T_odom_keyframe;
  // The scans around this keyframe were drawn with the correction of that time.
  node.T_map_drawn = T_map_odom_ * T_odom_keyframe;
  if (!node.corrected) node.T_map_keyframe = node.T_map_drawn;
  clouds_.add_keyframe(keyframe.id, keyframe.cloud, T_odom_keyframe);
  return true;
}

void LiveMap::correct(const Pose& T_map_odom, std::span<const CorrectedPose> poses, std::int32_t revision) {
  revision_ = revision;
  if (usable(T_map_odom)) {
    T_map_odom_ = T_map_odom;
  } else {
    ++refused_poses_;
  }
  for (const CorrectedPose& pose : poses) {
    if (!usable(pose.T_map_keyframe)) {
      ++refused_poses_;
      continue;
    }
    Node& node = nodes_[pose.id];
    node.T_map_keyframe = pose.T_map_keyframe;
    node.corrected = true;
  }
  corrected_since_loop_ = true;
}

void LiveMap::add_loop(std::int32_t from_id, std::int32_t to_id) {
  loops_.emplace(from_id, to_id);
  loop_is_new_ = true;
  corrected_since_loop_ = false;
}

void LiveMap::remove_loop(std::int32_t from_id, std::int32_t to_id) { loops_.erase({from_id, to_id}); }

void LiveMap::clear() {
  const int rebuilds = rebuilds_;
  const std::int64_t refused = refused_poses_;
  *this = LiveMap(config_);
  rebuilds_ = rebuilds;
  refused_poses_ = refused;
}

bool LiveMap::moved(const Pose& now, const Pose& drawn) const {
  return (now.translation - drawn.translation).norm() > config_.rebuild_shift_m ||
         now.rotation.angularDistance(drawn.rotation) > config_.rebuild_turn_rad;
}

bool LiveMap::needs_rebuild() const {
  if (rebuilding_) return false;
  if (loop_is_new_ && corrected_since_loop_) return true;
  return std::ranges::any_of(nodes_, [this](const auto& entry) {
    return entry.second.has_cloud && moved(entry.second.T_map_keyframe, entry.second.T_map_drawn);
  });
}

RebuildJob LiveMap::begin_rebuild() {
  RebuildJob job{.config = config_, .clouds = {}, .T_map_body = T_map_body()};
  for (auto& [id, node] : nodes_) {
    if (!node.has_cloud) continue;
    job.clouds.push_back({id, clouds_.cloud(id), node.T_map_keyframe});
    node.T_map_drawn = node.T_map_keyframe;
  }
  rebuilding_ = true;
  loop_is_new_ = false;
  waiting_.clear();
  return job;
}

void LiveMap::finish_rebuild(ThreeLevelMap map) {
  map_ = std::move(map);
  for (const WaitingScan& scan : waiting_) map_.insert(scan.points, T_map_odom_ * scan.T_odom_body);
  waiting_.clear();
  rebuilding_ = false;
  ++rebuilds_;
}

Pose LiveMap::T_map_odom_at(std::int32_t keyframe_id) const {
  const auto found = nodes_.find(keyframe_id);
  if (found == nodes_.end() || !found->second.has_cloud) return T_map_odom_;
  return found->second.T_map_keyframe * found->second.T_odom_keyframe.inverse();
}

std::vector<Eigen::Vector3f> LiveMap::corrected_path() const {
  return path_.corrected([this](std::int32_t id) {
    // What was driven before the first keyframe arrived belongs to that keyframe.
    return T_map_odom_at(id < 0 && !nodes_.empty() ? nodes_.begin()->first : id);
  });
}

std::vector<LoopEdge> LiveMap::loop_edges() const {
  std::vector<LoopEdge> edges;
  for (const auto& [from_id, to_id] : loops_) {
    const auto from = nodes_.find(from_id);
    const auto to = nodes_.find(to_id);
    if (from == nodes_.end() || to == nodes_.end()) continue;
    edges.push_back({from->second.T_map_keyframe.translation.cast<float>(),
                     to->second.T_map_keyframe.translation.cast<float>(), from_id, to_id});
  }
  return edges;
}

std::vector<std::pair<std::int32_t, Eigen::Vector3f>> LiveMap::keyframe_positions() const {
  std::vector<std::pair<std::int32_t, Eigen::Vector3f>> positions;
  for (const auto& [id, node] : nodes_) positions.emplace_back(id, node.T_map_keyframe.translation.cast<float>());
  return positions;
}

std::vector<Eigen::Vector3f> LiveMap::placed_cloud(std::int32_t id) const {
  std::vector<Eigen::Vector3f> points;
  const auto node = nodes_.find(id);
  if (node == nodes_.end()) return points;
  for (const CloudPoint& point : *clouds_.cloud(id)) {
    points.emplace_back((node->second.T_map_keyframe * Eigen::Vector3d(point.position.cast<double>())).cast<float>());
  }
  return points;
}

std::vector<std::int32_t> LiveMap::missing_keyframes(std::int32_t count) const {
  std::vector<std::int32_t> missing;
  for (std::int32_t id = 0; id < count; ++id) {
    const auto found = nodes_.find(id);
    if (found == nodes_.end() || !found->second.has_cloud) missing.push_back(id);
  }
  return missing;
}

}  // namespace ignis
