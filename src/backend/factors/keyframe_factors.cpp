// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/keyframe_factors.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/navigation/CombinedImuFactor.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/PriorFactor.h>
#include <gtsam/nonlinear/Values.h>
#include <gtsam/slam/BetweenFactor.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "backend/factors/gtsam_conversion.h"
#include "backend/factors/loose_odometry.h"
#include "backend/factors/open_shifts.h"
#include "backend/factors/preintegration.h"
#include "backend/factors/relative_pose_factor.h"
#include "backend/factors/sighted_speed_factor.h"
#include "backend/factors/start_tilt_factor.h"

namespace ignis {
namespace {

using gtsam::imuBias::ConstantBias;
using gtsam::noiseModel::Diagonal;
using gtsam::noiseModel::Isotropic;
using gtsam::symbol_shorthand::B;
using gtsam::symbol_shorthand::V;
using gtsam::symbol_shorthand::X;

double square(double v) { return v * v; }

constexpr double kUnknownTilt = 1.0;      // [rad] sigma where the start's tilt factor tells it instead
constexpr double kLeastNoiseShare = 0.1;  // of the tilt: less would be a factor of next to no noise

double prior_tilt(const BackendConfig& config) { return config.prior_tilt_deg * std::numbers::pi / 180.0; }

/// [rad] What the first pose's tilt is off by beside the part that an unknown bias makes: the noise of the start.
/// Nothing where the tilt is claimed to be known as well as that, so not by the accelerometer.
std::optional<double> start_noise(const BackendConfig& config) {
  const double variance = square(prior_tilt(config)) - square(config.prior_accel_bias / config.imu.gravity);
  if (variance < square(kLeastNoiseShare * prior_tilt(config))) return std::nullopt;
  return std::sqrt(variance);
}

/// Uncertainty about world axes (tilt about X and Z, heading about Y), told in body axes as GTSAM wants it.
gtsam::Matrix6 first_pose_covariance(const Pose& T_map_body, double tilt, const BackendConfig& config) {
  const gtsam::Vector3 about_world(square(tilt), square(config.prior_yaw_rad), square(tilt));
  const gtsam::Matrix3 R_body_map = T_map_body.rotation.conjugate().toRotationMatrix();
  gtsam::Matrix6 covariance = gtsam::Matrix6::Zero();
  covariance.topLeftCorner<3, 3>() = R_body_map * about_world.asDiagonal() * R_body_map.transpose();
  covariance.bottomRightCorner<3, 3>() = gtsam::I_3x3 * square(config.prior_position_m);
  return covariance;
}

/// The filter knows best how well it knows its velocity; at a moving start that is badly.
double first_velocity_sigma(const Keyframe& keyframe, const BackendConfig& config) {
  const double variance = keyframe.covariance.diagonal().segment<3>(kVelocity).maxCoeff();
  const double sigma = std::isfinite(variance) && variance > 0.0 ? std::sqrt(variance) : 0.0;
  return std::clamp(sigma, config.prior_velocity, 100.0);
}

gtsam::SharedNoiseModel bias_noise(double accel_sigma, double gyro_sigma) {
  gtsam::Vector6 sigmas;
  sigmas << gtsam::Vector3::Constant(accel_sigma), gtsam::Vector3::Constant(gyro_sigma);
  return Diagonal::Sigmas(sigmas);
}

void add_first_factors(const KeyframeLink& link, const BackendConfig& config, gtsam::NonlinearFactorGraph& factors) {
  const NavState& state = link.guess;
  const std::optional<double> noise = start_noise(config);
  const double tilt = noise ? kUnknownTilt : prior_tilt(config);
  factors.addPrior(X(link.id), to_gtsam(state.T_odom_body),
                   gtsam::noiseModel::Gaussian::Covariance(first_pose_covariance(state.T_odom_body, tilt, config)));
  if (noise) {
    const double gravity = config.imu.gravity;
    factors.push_back(make_start_tilt_factor(X(link.id), B(link.id), state, gravity, gravity * *noise));
  }
  factors.addPrior(V(link.id), gtsam::Vector3(state.v_odom), Isotropic::Sigma(3, link.velocity_sigma));
  factors.addPrior(B(link.id), bias_of(state), bias_noise(config.prior_accel_bias, config.prior_gyro_bias));
}

void add_loose_factors(const KeyframeLink& link, const BackendConfig& config, gtsam::NonlinearFactorGraph& factors) {
  const double root_time = std::sqrt(std::max(1e-3, link.interval_s));
  factors.push_back(
      make_relative_pose_factor(X(link.previous_id), X(link.id), link.T_previous_this, loose_rows(config)));
  factors.addPrior(V(link.id), gtsam::Vector3(link.guess.v_odom), Isotropic::Sigma(3, config.loose_velocity));
  factors.emplace_shared<gtsam::BetweenFactor<ConstantBias>>(
      B(link.previous_id), B(link.id), ConstantBias(),
      bias_noise(config.imu.accel_bias_walk * root_time, config.imu.gyro_bias_walk * root_time));
}

/// A state of the filter in map; its other fields stay.
NavState placed(NavState state, const Pose& T_map_odom) {
  state.T_odom_body = T_map_odom * state.T_odom_body;
  state.v_odom = T_map_odom.rotation * state.v_odom;
  return state;
}

/// Shifts that the interval's scans leave open, in body axes of its start.
Eigen::Matrix3d open_between(const Pose& T_previous_this, const Matrix6d& scan_information) {
  const Eigen::Matrix3d R = T_previous_this.rotation.toRotationMatrix();
  return R * open_shifts(scan_information.bottomRightCorner<3, 3>()) * R.transpose();
}

}  // namespace

KeyframeLink first_link(const Keyframe& keyframe, const BackendConfig& config) {
  KeyframeLink link;
  link.id = keyframe.id;
  link.stationary = keyframe.stationary;
  link.guess = keyframe.state;
  if (keyframe.stationary) link.guess.v_odom.setZero();
  link.velocity_sigma = keyframe.stationary ? config.stationary_velocity : first_velocity_sigma(keyframe, config);
  return link;
}

KeyframeLink next_link(const Keyframe& keyframe, const LinkEnd& previous, bool use_imu, const WhiteningRows& odometry,
                       const BackendConfig& config) {
  KeyframeLink link;
  link.id = keyframe.id;
  link.previous_id = previous.id;
  link.stationary = keyframe.stationary;
  link.interval_s = seconds_between(previous.filter.utime, keyframe.state.utime);
  link.T_previous_this = previous.filter.T_odom_body.inverse() * keyframe.state.T_odom_body;
  link.odometry = odometry;
  link.sighted = keyframe.sighted;
  const Pose T_map_odom = previous.estimate.T_odom_body * previous.filter.T_odom_body.inverse();
  link.guess = previous.estimate;
  link.guess.T_odom_body = previous.estimate.T_odom_body * link.T_previous_this;
  link.guess.v_odom = T_map_odom.rotation * keyframe.state.v_odom;
  if (use_imu) {
    const ImuSum sum = plain_sum(
        preintegrate(keyframe.imu, previous.filter.utime, keyframe.state.utime, previous.estimate, config.imu));
    link.imu = agreeing_along(open_between(link.T_previous_this, keyframe.scan_information),
                              placed(previous.filter, T_map_odom), placed(keyframe.state, T_map_odom),
                              config.imu.gravity, sum);
  }
  return link;
}

void add_link_factors(const KeyframeLink& link, const BackendConfig& config, gtsam::NonlinearFactorGraph& factors) {
  if (link.previous_id < 0) {
    add_first_factors(link, config, factors);
    return;
  }
  if (link.imu) {
    factors.emplace_shared<gtsam::CombinedImuFactor>(X(link.previous_id), V(link.previous_id), X(link.id), V(link.id),
                                                     B(link.previous_id), B(link.id), sum_of(*link.imu, config.imu));
  } else {
    add_loose_factors(link, config, factors);
  }
  if (link.odometry.rows() > 0) {
    factors.push_back(make_relative_pose_factor(X(link.previous_id), X(link.id), link.T_previous_this, link.odometry));
  }
  if (link.sighted) factors.push_back(make_sighted_speed_factor(X(link.id), V(link.id), *link.sighted));
  if (link.stationary) {
    factors.addPrior(V(link.id), gtsam::Vector3(gtsam::Z_3x1), Isotropic::Sigma(3, config.stationary_velocity));
  }
}

void insert_estimate(std::int32_t id, const NavState& state, gtsam::Values& values) {
  values.insert(X(id), to_gtsam(state.T_odom_body));
  values.insert(V(id), gtsam::Vector3(state.v_odom));
  values.insert(B(id), bias_of(state));
}

NavState estimate_of(const gtsam::Values& values, std::int32_t id) {
  NavState state;
  const auto bias = values.at<ConstantBias>(B(id));
  state.T_odom_body = from_gtsam(values.at<gtsam::Pose3>(X(id)));
  state.v_odom = values.at<gtsam::Vector3>(V(id));
  state.gyro_bias = bias.gyroscope();
  state.accel_bias = bias.accelerometer();
  return state;
}

NavState estimate_of(IncrementalSolver& solver, std::int32_t id) {
  return estimate_of(solver.estimate_of(std::array<std::uint64_t, 3>{X(id), V(id), B(id)}), id);
}

}  // namespace ignis
