// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/mover.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/frames.h"

namespace ignis::sim {
namespace {

/// Distance from a point to the half line of a ray.
double distance_to_ray(const Ray& ray, const Eigen::Vector3d& point) {
  const double along = std::max(ray.direction.dot(point - ray.origin), 0.0);
  return (ray.origin + along * ray.direction - point).norm();
}

}  // namespace

Mover::Mover(std::vector<Solid> solids, const std::vector<MoverStop>& stops, double speed, double start, bool loop)
    : solids_(std::move(solids)), start_(start), loop_(loop && stops.size() > 1) {
  for (std::size_t i = 0; i + 1 < stops.size(); ++i) add_stop(stops[i], stops[i + 1].position, speed);
  if (loop_) {
    add_stop(stops.back(), stops.front().position, speed);
  } else {
    const Eigen::Quaterniond heading =
        legs_.empty() ? Eigen::Quaterniond::Identity() : legs_.back().T_world_mover.rotation;
    append(0.0, {heading, stops.back().position}, Eigen::Vector3d::Zero());
  }
  for (const Solid& solid : solids_) reach_ = std::max(reach_, solid.center.norm() + solid.half_extent.norm());
}

void Mover::add_stop(const MoverStop& from, const Eigen::Vector3d& to, double speed) {
  const Eigen::Vector3d way = to - from.position;
  const Eigen::Quaterniond heading = frames::from_yaw_pitch_roll({.yaw = std::atan2(-way.x(), -way.z())});
  const Pose T_world_mover{heading, from.position};
  if (from.rest > 0.0) append(from.rest, T_world_mover, Eigen::Vector3d::Zero());
  append(way.norm() / speed, T_world_mover, way.normalized() * speed);
}

void Mover::append(double duration, const Pose& T_world_mover, const Eigen::Vector3d& velocity) {
  legs_.push_back({duration_, T_world_mover, velocity});
  duration_ += duration;
}

Pose Mover::T_world_mover(double time) const {
  double elapsed = std::max(time - start_, 0.0);
  elapsed = loop_ ? std::fmod(elapsed, duration_) : std::min(elapsed, duration_);
  const auto after =
      std::ranges::upper_bound(legs_, elapsed, {}, &Leg::begin);  // legs_[0].begin is 0, so there is one before
  const Leg& leg = *(after - 1);
  return {leg.T_world_mover.rotation, leg.T_world_mover.translation + (elapsed - leg.begin) * leg.velocity};
}

std::optional<Hit> Mover::cast(const Ray& ray, double limit, double time) const {
  const Pose pose = T_world_mover(time);
  if (distance_to_ray(ray, pose.translation) > reach_) return std::nullopt;
  const Pose T_mover_world = pose.inverse();
  const Ray ray_mover{T_mover_world * ray.origin, T_mover_world.rotation * ray.direction};
  std::optional<Hit> nearest;
  for (const Solid& solid : solids_) {
    const std::optional<Hit> hit = intersect(solid, ray_mover, nearest ? nearest->distance : limit);
    if (hit) nearest = hit;
  }
  if (nearest) nearest->normal = pose.rotation * nearest->normal;
  return nearest;
}

double Mover::clearance(const Eigen::Vector3d& point, double time) const {
  const Eigen::Vector3d point_mover = T_world_mover(time).inverse() * point;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Solid& solid : solids_) nearest = std::min(nearest, signed_distance(solid, point_mover));
  return nearest;
}

}  // namespace ignis::sim
