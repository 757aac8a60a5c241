// SPDX-License-Identifier: Apache-2.0
#include "map/driven_path.h"

namespace ignis {

void DrivenPath::add(const Eigen::Vector3d& p_odom, std::int32_t keyframe_id) {
  if (!points_.empty() && (points_.back().p_odom - p_odom).norm() < spacing_) return;
  if (points_.size() == kMaxPoints) {
    for (std::size_t i = 1; 2 * i < points_.size(); ++i) points_[i] = points_[2 * i];
    points_.resize((points_.size() + 1) / 2);
    spacing_ *= 2.0;
  }
  points_.push_back({p_odom, keyframe_id});
}

void DrivenPath::clear() {
  points_.clear();
  spacing_ = kFirstSpacing;
}

std::vector<Eigen::Vector3f> DrivenPath::odometry() const {
  std::vector<Eigen::Vector3f> positions;
  positions.reserve(points_.size());
  for (const Point& point : points_) positions.emplace_back(point.p_odom.cast<float>());
  return positions;
}

std::vector<Eigen::Vector3f> DrivenPath::corrected(const std::function<Pose(std::int32_t)>& T_map_odom_at) const {
  std::vector<Eigen::Vector3f> positions;
  positions.reserve(points_.size());
  Pose T_map_odom;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const bool same_keyframe = i > 0 && points_[i].keyframe_id == points_[i - 1].keyframe_id;
    if (!same_keyframe) T_map_odom = T_map_odom_at(points_[i].keyframe_id);
    positions.emplace_back((T_map_odom * points_[i].p_odom).cast<float>());
  }
  return positions;
}

}  // namespace ignis
