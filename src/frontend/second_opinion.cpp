// SPDX-License-Identifier: Apache-2.0
#include "frontend/second_opinion.h"

#include <cmath>

namespace ignis {
namespace {

constexpr double kWindowSeconds = 2.0;      // over which scans and IMU are compared
constexpr double kMarkSeconds = 0.5;        // between two marks
constexpr double kShareOfNewestScan = 0.1;  // in running means: half a second of scans
// Beyond this share of planes that face along a direction, scans know better. Along the axis of a corridor that planes
// held which were none it was 0.002 to 0.01, in a bare hall 0.03 to 0.3; in a good hall 0.1 to 0.5.
constexpr double kMostSensitivity = 0.3;

}  // namespace

void SecondOpinion::note_scan(const FilterState& corrected, const Eigen::Vector3d& velocity_correction,
                              const Eigen::Matrix3d& facing) {
  newest_ = corrected.nominal.utime;
  facing_ += kShareOfNewestScan * (facing - facing_);
  for (Mark& mark : marks_) mark.corrected += velocity_correction;
  if (marks_.size() > 1 && seconds_between(marks_[1].state.nominal.utime, newest_) >= kWindowSeconds) {
    marks_.erase(marks_.begin());
  }
  if (marks_.empty() || seconds_between(marks_.back().state.nominal.utime, newest_) >= kMarkSeconds) {
    marks_.push_back({.state = corrected});
  }
}

std::optional<Contradiction> SecondOpinion::contradiction() const {
  if (marks_.empty() || config_.contradiction_sigma <= 0.0) return std::nullopt;
  const Mark& oldest = marks_.front();
  const double seconds = seconds_between(oldest.state.nominal.utime, newest_);
  const double gained = oldest.corrected.norm();
  if (seconds < kMarkSeconds || !(gained > 0.0)) return std::nullopt;
  Contradiction result{.since = oldest.state, .direction = oldest.corrected / gained};
  const Eigen::Vector3d& d = result.direction;
  const Eigen::Matrix3d acceleration = rest_acceleration_covariance(oldest.state, config_.gravity_m);
  const double variance = d.dot(oldest.state.covariance.block<3, 3>(kVelocity, kVelocity) * d) +
                          d.dot(acceleration * d) * seconds * seconds +
                          config_.imu_noise_accel * config_.imu_noise_accel * seconds;
  result.sigmas = gained / std::sqrt(variance);
  result.sensitivity = d.dot(facing_ * d);
  if (result.sigmas < config_.contradiction_sigma || result.sensitivity > kMostSensitivity) return std::nullopt;
  return result;
}

}  // namespace ignis
