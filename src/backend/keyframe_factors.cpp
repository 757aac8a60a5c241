// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframe_factors.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/navigation/CombinedImuFactor.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/PriorFactor.h>
#include <gtsam/nonlinear/Values.h>
#include <gtsam/slam/BetweenFactor.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "backend/gtsam_conversion.h"
#include "backend/preintegration.h"
#include "backend/relative_pose_factor.h"

namespace ignis {
namespace {

using gtsam::imuBias::ConstantBias;
using gtsam::noiseModel::Diagonal;
using gtsam::noiseModel::Isotropic;
using gtsam::symbol_shorthand::B;
using gtsam::symbol_shorthand::V;
using gtsam::symbol_shorthand::X;

double square(double v) { return v * v; }

/// Uncertainty about world axes (tilt about X and Z, heading about Y), told in body axes as GTSAM wants it.
gtsam::Matrix6 first_pose_covariance(const Pose& T_map_body, const BackendConfig& config) {
  const double tilt = config.prior_tilt_deg * std::numbers::pi / 180.0;
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

void add_imu(const Keyframe& keyframe, const LinkEnd& previous, const BackendConfig& config,
             gtsam::NonlinearFactorGraph& factors) {
  const gtsam::PreintegratedCombinedMeasurements sum =
      preintegrate(keyframe.imu, previous.utime, keyframe.state.utime, previous.estimate, config.imu);
  factors.emplace_shared<gtsam::CombinedImuFactor>(X(previous.id), V(previous.id), X(keyframe.id), V(keyframe.id),
                                                   B(previous.id), B(keyframe.id), sum);
}

void add_loose_links(const Keyframe& keyframe, const LinkEnd& previous, const Pose& T_previous_this,
                     const gtsam::Vector3& v_map, const BackendConfig& config, gtsam::NonlinearFactorGraph& factors) {
  const double root_time = std::sqrt(std::max(1e-3, seconds_between(previous.utime, keyframe.state.utime)));
  factors.push_back(make_relative_pose_factor(X(previous.id), X(keyframe.id), T_previous_this, loose_rows(config)));
  factors.addPrior(V(keyframe.id), v_map, Isotropic::Sigma(3, config.loose_velocity));
  factors.emplace_shared<gtsam::BetweenFactor<ConstantBias>>(
      B(previous.id), B(keyframe.id), ConstantBias(),
      bias_noise(config.imu.accel_bias_walk * root_time, config.imu.gyro_bias_walk * root_time));
}

}  // namespace

WhiteningRows loose_rows(const BackendConfig& config) {
  Vector6d information;
  information << Eigen::Vector3d::Constant(1.0 / square(config.loose_rotation_rad)),
      Eigen::Vector3d::Constant(1.0 / square(config.loose_position_m));
  return whitening(information.asDiagonal());
}

void add_first_keyframe(const Keyframe& keyframe, const BackendConfig& config, gtsam::NonlinearFactorGraph& factors,
                        gtsam::Values& values) {
  const NavState& state = keyframe.state;
  const gtsam::Pose3 T_map_body = to_gtsam(state.T_odom_body);
  const gtsam::Vector3 v_map = keyframe.stationary ? gtsam::Vector3(gtsam::Z_3x1) : gtsam::Vector3(state.v_odom);
  const double velocity_sigma =
      keyframe.stationary ? config.stationary_velocity : first_velocity_sigma(keyframe, config);
  values.insert(X(keyframe.id), T_map_body);
  values.insert(V(keyframe.id), v_map);
  values.insert(B(keyframe.id), bias_of(state));
  factors.addPrior(X(keyframe.id), T_map_body,
                   gtsam::noiseModel::Gaussian::Covariance(first_pose_covariance(state.T_odom_body, config)));
  factors.addPrior(V(keyframe.id), v_map, Isotropic::Sigma(3, velocity_sigma));
  factors.addPrior(B(keyframe.id), bias_of(state), bias_noise(config.prior_accel_bias, config.prior_gyro_bias));
}

void add_next_keyframe(const Keyframe& keyframe, const LinkEnd& previous, bool use_imu, const WhiteningRows& odometry,
                       const BackendConfig& config, gtsam::NonlinearFactorGraph& factors, gtsam::Values& values) {
  const Pose T_previous_this = previous.T_odom_body.inverse() * keyframe.state.T_odom_body;
  const Pose T_map_odom = previous.estimate.T_odom_body * previous.T_odom_body.inverse();
  const gtsam::Vector3 v_map = T_map_odom.rotation * keyframe.state.v_odom;
  values.insert(X(keyframe.id), to_gtsam(previous.estimate.T_odom_body * T_previous_this));
  values.insert(V(keyframe.id), v_map);
  values.insert(B(keyframe.id), bias_of(previous.estimate));
  if (use_imu) {
    add_imu(keyframe, previous, config, factors);
  } else {
    add_loose_links(keyframe, previous, T_previous_this, v_map, config, factors);
  }
  if (odometry.rows() > 0) {
    factors.push_back(make_relative_pose_factor(X(previous.id), X(keyframe.id), T_previous_this, odometry));
  }
  if (keyframe.stationary) {
    factors.addPrior(V(keyframe.id), gtsam::Vector3(gtsam::Z_3x1), Isotropic::Sigma(3, config.stationary_velocity));
  }
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

}  // namespace ignis
