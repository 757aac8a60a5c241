// SPDX-License-Identifier: Apache-2.0
#include "map/keyframe_clouds.h"

#include <cmath>

namespace ignis {
namespace {

std::shared_ptr<const std::vector<CloudPoint>> points_of(const VoxelLevel& voxels) {
  auto points = std::make_shared<std::vector<CloudPoint>>();
  points->reserve(voxels.size());
  for (const auto& [cell, point] : voxels.sorted()) {
    points->push_back({point.p_world.cast<float>(), point.intensity});
  }
  return points;
}

}  // namespace

KeyframeClouds::KeyframeClouds(double cell_m, std::size_t max_points) : max_points_(max_points), open_(cell_m) {}

void KeyframeClouds::add_keyframe(std::int32_t id, std::span<const CloudPoint> points_body,
                                  const Pose& T_odom_keyframe) {
  if (entries_.contains(id)) return;
  const bool is_newest = entries_.empty() || id > entries_.rbegin()->first;
  if (is_newest) {
    close_newest();
    entries_[id] = {T_odom_keyframe, nullptr};
    insert_open(points_body, Pose{});
  } else {
    // A keyframe that was sent again after a loss: its scans went to its predecessor.
    auto points = std::make_shared<const std::vector<CloudPoint>>(points_body.begin(), points_body.end());
    closed_points_ += points->size();
    entries_[id] = {T_odom_keyframe, std::move(points)};
  }
  while (points() > max_points_ && entries_.size() > 1) drop_farthest();
}

void KeyframeClouds::add_scan(std::span<const CloudPoint> points_body, const Pose& T_odom_body) {
  if (entries_.empty()) return;
  insert_open(points_body, entries_.rbegin()->second.T_odom_keyframe.inverse() * T_odom_body);
}

void KeyframeClouds::insert_open(std::span<const CloudPoint> points, const Pose& T_keyframe_points) {
  for (const CloudPoint& point : points) {
    const Eigen::Vector3d p_keyframe = T_keyframe_points * Eigen::Vector3d(point.position.cast<double>());
    const bool fits = p_keyframe.allFinite() && p_keyframe.cwiseAbs().maxCoeff() < VoxelLevel::kMaxCoordinate;
    if (fits) open_.insert({p_keyframe, point.intensity, kLive});
  }
}

void KeyframeClouds::close_newest() {
  if (entries_.empty()) return;
  Entry& newest = entries_.rbegin()->second;
  newest.points = points_of(open_);
  closed_points_ += newest.points->size();
  open_.clear();
}

void KeyframeClouds::drop_farthest() {
  const Eigen::Vector3d here = entries_.rbegin()->second.T_odom_keyframe.translation;
  auto farthest = entries_.begin();
  double largest = -1.0;
  for (auto entry = entries_.begin(); std::next(entry) != entries_.end(); ++entry) {
    const Eigen::Vector3d offset = entry->second.T_odom_keyframe.translation - here;
    const double distance = std::hypot(offset.x(), offset.z());
    if (distance > largest) {
      largest = distance;
      farthest = entry;
    }
  }
  closed_points_ -= farthest->second.points->size();
  entries_.erase(farthest);
  ++dropped_;
}

std::size_t KeyframeClouds::points() const { return closed_points_ + open_.size(); }

std::shared_ptr<const std::vector<CloudPoint>> KeyframeClouds::cloud(std::int32_t id) const {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return std::make_shared<const std::vector<CloudPoint>>();
  return found->second.points ? found->second.points : points_of(open_);
}

void KeyframeClouds::clear() {
  entries_.clear();
  open_.clear();
  closed_points_ = 0;
}

}  // namespace ignis
