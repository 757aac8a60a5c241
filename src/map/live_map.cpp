// SPDX-License-Identifier: Apache-2.0
#include "map/live_map.h"

#include <algorithm>

namespace ignis {

ThreeLevelMap rebuild(const RebuildJob& job, const std::function<void()>& got_on) {
  ThreeLevelMap map(job.config);
  std::map<std::int32_t, SharedCloud> store;
  const ThreeLevelMap::CloudLookup lookup = [&](std::int32_t id) { return view_of(*store.at(id)); };
  map.set_coarsening(job.coarsening, lookup);
  map.place_windows(job.centre);
  // All votes before the first point, so that nothing enters that would be carved.
  for (const PlacedCloud& cloud : job.clouds) {
    store[cloud.id] = cloud.cloud;
    map.add_cloud(cloud.id, cloud.T_map_keyframe);
    if (cloud.id != job.open_cloud) map.cast_votes(cloud.id, lookup);
    if (got_on) got_on();
  }
  for (const PlacedCloud& cloud : job.clouds) {
    map.insert(cloud.id, cloud.cloud->points);
    map.stay_within_bound(lookup);
    if (got_on) got_on();
  }
  map.set_open_cloud(job.open_cloud);
  return map;
}

LiveMap::LiveMap(const MapConfig& config)
    : config_(config),
      map_(config),
      clouds_(config.local_cell_m, static_cast<std::size_t>(config.max_keyframe_points)) {
  if (config.carve_free_space) clouds_.follow_rays(FreeSpace(config.mid_cell_m, config.carve_rays));
}

ThreeLevelMap::CloudLookup LiveMap::lookup() const {
  return [this](std::int32_t id) { return drawing_ ? clouds_.view(id) : StoredCloud{}; };
}

InsertCounts LiveMap::insert_scan(std::span<const CloudPoint> points_body, const Pose& T_odom_body) {
  newest_kept_ = {};
  if (!usable(T_odom_body) || !usable(T_map_odom_ * T_odom_body)) {
    ++refused_poses_;
    return {.rejected = points_body.size()};
  }
  T_odom_body_ = T_odom_body;
  path_.add(T_odom_body.translation, nodes_.empty() ? KeyframeClouds::kBeforeFirst : nodes_.rbegin()->first);
  map_.follow(T_map_body().translation, lookup());
  const KeyframeClouds::Kept kept = clouds_.add_scan(points_body, T_odom_body);
  newest_kept_ = kept.which;
  InsertCounts counts = show(kept);
  counts.known = points_body.size() - kept.points.size() - kept.unusable;
  drop_far_clouds();
  return counts;
}

bool LiveMap::add_keyframe(const Keyframe& keyframe) {
  newest_kept_ = {};
  const Pose& T_odom_keyframe = keyframe.state.T_odom_body;
  if (keyframe.id < 0 || !usable(T_odom_keyframe) || !usable(T_map_odom_ * T_odom_keyframe)) {
    ++refused_poses_;
    return false;
  }
  Node& node = nodes_[keyframe.id];
  if (node.has_cloud) return true;
  node.has_cloud = true;
  node.utime = keyframe.state.utime;
  node.T_odom_keyframe = T_odom_keyframe;
  if (!node.corrected) node.T_map_keyframe = T_map_odom_ * T_odom_keyframe;
  const KeyframeClouds::Kept kept = clouds_.add_keyframe(keyframe.id, keyframe.cloud, T_odom_keyframe);
  newest_kept_ = kept.which;
  show(kept);
  cast_votes();
  drop_far_clouds();
  settle();  // the first keyframe tells where what came before belongs
  return true;
}

bool LiveMap::has_come(std::int32_t id) const {
  const auto found = nodes_.find(id);
  return found != nodes_.end() && found->second.has_cloud;
}

bool LiveMap::is_of_another_drive(const Keyframe& keyframe) const {
  if (const auto same = nodes_.find(keyframe.id); same != nodes_.end() && same->second.has_cloud) {
    return same->second.utime != keyframe.state.utime ||
           same->second.T_odom_keyframe.translation != keyframe.state.T_odom_body.translation;
  }
  if (keyframe.id <= 0) return false;
  const auto previous = nodes_.find(keyframe.id - 1);
  return previous != nodes_.end() && previous->second.has_cloud && previous->second.utime != keyframe.previous_utime;
}

/// Draws points that a keyframe has just kept.
InsertCounts LiveMap::show(const KeyframeClouds::Kept& kept) {
  if (!map_.contains(kept.id)) map_.add_cloud(kept.id, newest_pose(kept.id));
  map_.set_open_cloud(clouds_.open_id());
  if (rebuilding_) arrivals_.push_back({kept.id, {kept.points.begin(), kept.points.end()}});
  InsertCounts counts;
  if (drawing_) {
    counts = map_.insert(kept.id, kept.points);
    map_.stay_within_bound(lookup());
  }
  counts.rejected += kept.unusable;
  refused_points_ += static_cast<std::int64_t>(counts.rejected);
  return counts;
}

/// Whoever has just been closed says what it found free.
void LiveMap::cast_votes() {
  if (!config_.carve_free_space || !drawing_) return;
  for (const std::int32_t id : map_.cloud_ids()) {
    if (id != clouds_.open_id() && !map_.has_voted(id)) map_.cast_votes(id, lookup());
  }
}

/// Not while a map is being built from them. Where many clouds overlap, what is left is read again for each tile that
/// one of them leaves: that is for a rebuild.
void LiveMap::drop_far_clouds() {
  if (rebuilding_) return;
  leaving_ = clouds_.beyond_bound();
  if (leaving_.empty() || is_for_a_rebuild(leaving_)) return;
  map_.remove_clouds(leaving_, lookup());
  clouds_.drop(std::exchange(leaving_, {}));
}

bool LiveMap::is_for_a_rebuild(std::span<const std::int32_t> changed) const {
  return map_.cost_of_moving(changed, lookup()) > static_cast<std::size_t>(config_.reanchor_points);
}

void LiveMap::correct(const Pose& T_map_odom, std::span<const CorrectedPose> poses, std::int32_t revision) {
  if (usable(T_map_odom)) {
    T_map_odom_ = T_map_odom;
  } else {
    ++refused_poses_;
  }
  for (const CorrectedPose& pose : poses) {
    if (pose.id < 0 || !usable(pose.T_map_keyframe)) {
      ++refused_poses_;
      continue;
    }
    Node& node = nodes_[pose.id];
    node.T_map_keyframe = pose.T_map_keyframe;
    node.corrected = true;
  }
  newest_revision_ = revision;
  settle();
}

/// Brings the map to the newest poses, or finds that a rebuild has to.
void LiveMap::settle() {
  if (rebuilding_) return;
  std::vector<std::pair<std::int32_t, Pose>> moved;
  std::vector<std::int32_t> ids;
  for (const std::int32_t id : map_.cloud_ids()) {
    const Pose newest = newest_pose(id);
    if (!differs(newest, map_.pose(id))) continue;
    moved.emplace_back(id, newest);
    ids.push_back(id);
  }
  moved_far_ = !ids.empty() && is_for_a_rebuild(ids);
  if (moved_far_) return;
  if (!moved.empty()) map_.move_clouds(moved, lookup());
  reanchored_ += static_cast<std::int64_t>(moved.size());
  drawn_revision_ = newest_revision_;
}

RebuildJob LiveMap::as_drawn() const {
  RebuildJob job{.config = config_,
                 .clouds = {},
                 .centre = map_.windows().centre,
                 .coarsening = map_.coarsening(),
                 .open_cloud = map_.open_cloud()};
  for (const std::int32_t id : map_.cloud_ids()) job.clouds.push_back({id, clouds_.share(id), map_.pose(id)});
  return job;
}

RebuildJob LiveMap::begin_rebuild() {
  RebuildJob job = as_drawn();
  job.coarsening = 0;
  std::erase_if(job.clouds, [&](const PlacedCloud& cloud) { return std::ranges::contains(leaving_, cloud.id); });
  for (PlacedCloud& cloud : job.clouds) cloud.T_map_keyframe = newest_pose(cloud.id);
  rebuilt_revision_ = newest_revision_;
  rebuilding_ = true;
  moved_far_ = false;
  arrivals_.clear();
  return job;
}

void LiveMap::finish_rebuild(ThreeLevelMap map) {
  map.continue_versions(map_);
  map_ = std::move(map);
  clouds_.drop(std::exchange(leaving_, {}));
  rebuilding_ = false;
  drawing_ = true;
  for (const Arrival& arrival : std::exchange(arrivals_, {})) {
    if (!map_.contains(arrival.id)) map_.add_cloud(arrival.id, newest_pose(arrival.id));
    map_.insert(arrival.id, arrival.points);
  }
  map_.set_open_cloud(clouds_.open_id());
  cast_votes();
  map_.follow(T_map_body().translation, lookup());
  map_.stay_within_bound(lookup());
  drawn_revision_ = rebuilt_revision_;
  ++rebuilds_;
  settle();
  drop_far_clouds();
}

void LiveMap::clear() {
  ThreeLevelMap empty(config_);
  empty.continue_versions(map_);
  map_ = std::move(empty);
  clouds_.clear();
  path_.clear();
  nodes_.clear();
  loops_.clear();
  T_map_odom_ = T_odom_body_ = Pose{};
  newest_revision_ = drawn_revision_ = 0;
  moved_far_ = rebuilding_ = false;
  leaving_.clear();
  arrivals_.clear();
}

void LiveMap::add_loop(std::int32_t from_id, std::int32_t to_id) { loops_.emplace(from_id, to_id); }

void LiveMap::remove_loop(std::int32_t from_id, std::int32_t to_id) { loops_.erase({from_id, to_id}); }

bool LiveMap::differs(const Pose& a, const Pose& b) const {
  return (a.translation - b.translation).norm() > config_.rebuild_shift_m ||
         a.rotation.angularDistance(b.rotation) > config_.rebuild_turn_rad;
}

Pose LiveMap::T_map_odom_at(std::int32_t keyframe_id) const {
  const auto found = nodes_.find(keyframe_id);
  if (found == nodes_.end() || !found->second.has_cloud) return T_map_odom_;
  return found->second.T_map_keyframe * found->second.T_odom_keyframe.inverse();
}

/// Where a cloud belongs. What was seen before the first keyframe goes with that keyframe.
Pose LiveMap::newest_pose(std::int32_t cloud_id) const {
  if (cloud_id >= 0) return nodes_.at(cloud_id).T_map_keyframe;
  return T_map_odom_at(nodes_.empty() ? cloud_id : nodes_.begin()->first) * clouds_.T_odom_keyframe(cloud_id);
}

std::vector<Eigen::Vector3f> LiveMap::corrected_path() const {
  return path_.corrected(
      [this](std::int32_t id) { return T_map_odom_at(id < 0 && !nodes_.empty() ? nodes_.begin()->first : id); });
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
  if (id < 0 || !clouds_.contains(id)) return points;
  const Pose T_map_keyframe = newest_pose(id);
  for (const CloudPoint& point : clouds_.view(id).points) {
    points.emplace_back((T_map_keyframe * Eigen::Vector3d(point.position.cast<double>())).cast<float>());
  }
  return points;
}

std::vector<std::int32_t> LiveMap::missing_keyframes(std::int32_t count, std::size_t limit,
                                                     const std::function<bool(std::int32_t)>& wanted) const {
  std::vector<std::int32_t> missing;
  for (std::int32_t id = 0; id < count && missing.size() < limit; ++id) {
    if (!has_come(id) && wanted(id)) missing.push_back(id);
  }
  return missing;
}

}  // namespace ignis
