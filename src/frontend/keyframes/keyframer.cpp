// SPDX-License-Identifier: Apache-2.0
#include "frontend/keyframes/keyframer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/frames.h"
#include "frontend/local_map/voxel_downsample.h"

namespace ignis {
namespace {

constexpr double kLongestImu = 120.0;  // s: nobody integrates a longer interval (backend.imu.max_interval_s)
constexpr double kSecondsBetweenSeldomOnes = 1.0;
constexpr double kStationaryDisplacement = 0.03;  // m: above the jitter of a standing filter
constexpr double kStationaryTurnRate = 0.02;      // rad/s, mean over the interval

double heading_change(const NavState& from, const NavState& to) {
  const double change =
      frames::to_yaw_pitch_roll(to.T_odom_body.rotation).yaw - frames::to_yaw_pitch_roll(from.T_odom_body.rotation).yaw;
  return std::abs(std::remainder(change, 2.0 * std::numbers::pi));
}

double velocity_variance(const FilterState& filter, const Eigen::Vector3d& axis) {
  return axis.dot(filter.covariance.block<3, 3>(kVelocity, kVelocity) * axis);
}

}  // namespace

Keyframer::Keyframer(const FrontendConfig& config, std::int32_t session)
    : config_(config), session_(session), information_(config) {
  config::require_valid(config, "frontend");
}

void Keyframer::add_imu(const ImuSample& sample) {
  if (next_id_ == 0) return;
  // A pose that nobody confirms for an hour must not fill the memory, nor the next keyframe.
  if (!imu_.empty() && seconds_between(imu_.front().utime, sample.utime) > kLongestImu) {
    imu_.clear();
    imu_complete_ = false;
  }
  imu_.push_back(sample);
  information_.add_imu(sample);
}

void Keyframer::add_standstill(const Standstill& standstill) {
  if (next_id_ > 0) information_.add_standstill(standstill);
}

void Keyframer::add_sighted(const SightedSpeed& sighted, const FilterState& corrected) {
  if (next_id_ == 0) return;
  taken_ = {sighted, corrected.nominal.v_odom, velocity_variance(corrected, sighted.axis)};
}

std::optional<Keyframe> Keyframer::add_scan(const FilterState& filter, const Matrix6d& information_body,
                                            std::span<const Eigen::Vector3d> blind, std::vector<CloudPoint> cloud,
                                            KeyframePace pace) {
  const NavState& state = filter.nominal;
  recent_.push_back({state.utime, state.T_odom_body, std::move(cloud)});
  const Utime oldest = state.utime - to_micros(config_.keyframe_cloud_seconds);
  while (recent_.front().utime <= oldest) recent_.pop_front();

  if (next_id_ > 0) information_.add_scan(state, information_body, blind);
  ++scans_;
  note_motion(state);
  if (!allows(pace, state) || !due(state)) return std::nullopt;
  return make(filter);
}

void Keyframer::note_motion(const NavState& state) {
  speed2_sum_ += state.v_odom.squaredNorm();
  max_displacement_ =
      std::max(max_displacement_, (state.T_odom_body.translation - last_.T_odom_body.translation).norm());
}

bool Keyframer::due(const NavState& state) const {
  if (next_id_ == 0) return true;
  const double distance = (state.T_odom_body.translation - last_.T_odom_body.translation).norm();
  return distance >= config_.keyframe_dist_m || heading_change(last_, state) >= config_.keyframe_yaw_rad ||
         seconds_between(last_.utime, state.utime) >= config_.keyframe_max_seconds;
}

bool Keyframer::allows(KeyframePace pace, const NavState& state) const {
  if (pace != KeyframePace::kSeldom) return pace == KeyframePace::kAsDriven;
  return next_id_ == 0 || seconds_between(last_.utime, state.utime) >= kSecondsBetweenSeldomOnes;
}

bool Keyframer::stood_still(const NavState& state) const {
  if (imu_.empty() || !imu_complete_) return false;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();
  const auto count = static_cast<double>(imu_.size());
  for (const ImuSample& sample : imu_) {
    gyro += (sample.gyro - state.gyro_bias) / count;
    accel += (sample.accel - state.accel_bias) / count;
  }
  return max_displacement_ < kStationaryDisplacement && gyro.norm() < kStationaryTurnRate &&
         std::abs(accel.norm() - config_.gravity_m) < config_.rest_accel_band &&
         speed2_sum_ < scans_ * config_.stationary_speed * config_.stationary_speed;
}

std::vector<CloudPoint> Keyframer::merged_cloud(const Pose& T_odom_body) const {
  const Pose T_body_odom = T_odom_body.inverse();
  std::vector<CloudPoint> merged;
  for (const RegisteredScan& scan : recent_) {
    const Pose T_keyframe_scan = T_body_odom * scan.T_odom_body;
    const Eigen::Matrix3f R = T_keyframe_scan.rotation.toRotationMatrix().cast<float>();
    const Eigen::Vector3f t = T_keyframe_scan.translation.cast<float>();
    for (const CloudPoint& point : scan.cloud) merged.push_back({R * point.position + t, point.intensity});
  }
  return voxel_downsample(merged, config_.voxel_size_m);
}

/// What was told, since which the vehicle has gained speed and the filter has become less sure of it.
std::optional<SightedSpeed> Keyframer::sighted_now(const FilterState& filter) const {
  if (!taken_) return std::nullopt;
  const Eigen::Quaterniond R_body_odom = filter.nominal.T_odom_body.rotation.conjugate();
  const SightedSpeed& then = taken_->sighted;
  const double doubt = velocity_variance(filter, then.axis) - taken_->velocity_variance;
  return SightedSpeed{.axis = R_body_odom * then.axis,
                      .speed = then.speed + then.axis.dot(filter.nominal.v_odom - taken_->v_odom),
                      .variance = then.variance + std::max(doubt, 0.0)};
}

Keyframe Keyframer::make(const FilterState& filter) {
  const NavState& state = filter.nominal;
  Keyframe keyframe;
  keyframe.id = next_id_;
  keyframe.session = session_;
  keyframe.state = state;
  keyframe.covariance = filter.covariance.topLeftCorner<15, 15>();
  keyframe.cloud = merged_cloud(state.T_odom_body);
  keyframe.previous_utime = next_id_ == 0 ? state.utime : last_.utime;
  if (next_id_ > 0) {
    keyframe.scan_information = information_.information();
    keyframe.sighted = sighted_now(filter);
    keyframe.stationary = stood_still(state);
    keyframe.imu_complete = imu_complete_;
  }
  keyframe.imu = std::exchange(imu_, {});

  ++next_id_;
  last_ = state;
  information_.begin(filter);
  imu_complete_ = true;
  taken_.reset();
  scans_ = 0;
  speed2_sum_ = 0.0;
  max_displacement_ = 0.0;
  return keyframe;
}

}  // namespace ignis
