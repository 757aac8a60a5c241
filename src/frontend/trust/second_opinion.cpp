// SPDX-License-Identifier: Apache-2.0
#include "frontend/trust/second_opinion.h"

#include <cmath>

#include <Eigen/Eigenvalues>

namespace ignis {
namespace {

constexpr double kWindowSeconds = 2.0;      // over which scans and IMU are compared
constexpr double kStartSeconds = 3.0;       // that show whether the vehicle stood
constexpr double kMovingSeconds = 10.0;     // until what was wrong with a start in motion is forgotten
constexpr double kMarkSeconds = 0.5;        // between two marks
constexpr double kShareOfNewestScan = 0.1;  // in running means: half a second of scans
// Beyond this share of planes that face along a direction, scans know better. Along the axis of a corridor that planes
// held which were none it was 0.001 to 0.01, behind a forklift 0.003; in a good hall 0.1 to 0.5.
constexpr double kMostSensitivity = 0.2;
// From this share on planes are hardly all wrong, and the IMU has to be so much surer to be heard. In 28,000 scans of a
// good drive of 2 km, whose map had bent away from level, the sum once exceeded 4.2 sigma along a direction that more
// planes than that faced (and stayed below 5), and what came of it was 2 m off.
constexpr double kFewSensitivity = 0.03;
constexpr double kSurer = 1.7;

}  // namespace

void SecondOpinion::begin(Utime start) {
  forget();
  start_ends_ = start + to_micros(kStartSeconds);
  silent_until_ = start_ends_;
}

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

std::optional<Contradiction> SecondOpinion::contradiction() {
  if (config_.contradiction_sigma <= 0.0) return std::nullopt;
  std::optional<Contradiction> found = largest();
  if (!found || found->sigmas < config_.contradiction_sigma) return std::nullopt;
  if (newest_ >= silent_until_) return found;
  if (newest_ < start_ends_) silent_until_ = newest_ + to_micros(kMovingSeconds);
  return std::nullopt;
}

std::optional<Contradiction> SecondOpinion::largest() const {
  if (marks_.empty()) return std::nullopt;
  const Mark& oldest = marks_.front();
  const double seconds = seconds_between(oldest.state.nominal.utime, newest_);
  if (seconds < kMarkSeconds) return std::nullopt;
  const Eigen::Matrix3d acceleration = rest_acceleration_covariance(oldest.state, config_.gravity_m);
  const Eigen::Matrix3d explained =
      oldest.state.covariance.block<3, 3>(kVelocity, kVelocity) + seconds * seconds * acceleration +
      config_.imu_noise_accel * config_.imu_noise_accel * seconds * Eigen::Matrix3d::Identity();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(facing_);
  Contradiction result{.since = oldest.state};
  for (int k = 0; k < 3 && solver.eigenvalues()[k] < kMostSensitivity; ++k) {
    const Eigen::Vector3d direction = solver.eigenvectors().col(k);
    const double surer = solver.eigenvalues()[k] < kFewSensitivity ? 1.0 : kSurer;
    const double sigmas =
        std::abs(direction.dot(oldest.corrected)) / (surer * std::sqrt(direction.dot(explained * direction)));
    if (sigmas <= result.sigmas) continue;
    result.direction = direction;
    result.sigmas = sigmas;
  }
  return result;
}

}  // namespace ignis
