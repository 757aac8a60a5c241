// SPDX-License-Identifier: Apache-2.0
#include "frontend/start/start_state.h"

#include <format>

#include "common/frames.h"
#include "frontend/start/imu_initialisation.h"

namespace ignis {
namespace {

constexpr double kStandingSpeed = 0.03;  // [m/s] scans of a vehicle that stands make up to 0.015
constexpr double kStandingTurn = 0.006;  // [rad/s] and 0.003

}  // namespace

bool SteadyMotion::is_rolling() const {
  return twist.tail<3>().norm() > kStandingSpeed || twist.head<3>().norm() > kStandingTurn;
}

void set_rolling(FilterState& first, const SteadyMotion& motion, double gravity_m) {
  const Eigen::Matrix3d R = first.nominal.T_odom_body.rotation.toRotationMatrix();
  const Eigen::Vector3d turn = motion.twist.head<3>();
  const Eigen::Vector3d velocity = motion.twist.tail<3>();
  first.nominal.gyro_bias -= turn;
  first.nominal.angular_rate += turn;
  first.nominal.v_odom = R * velocity;
  first.covariance.block<3, 3>(kGyroBias, kGyroBias) += motion.covariance.topLeftCorner<3, 3>();
  first.covariance.middleRows<3>(kVelocity).setZero();
  first.covariance.middleCols<3>(kVelocity).setZero();
  first.covariance.block<3, 3>(kVelocity, kVelocity) = R * motion.covariance.bottomRightCorner<3, 3>() * R.transpose();
  const double tilt = turn.cross(velocity).norm() / gravity_m;
  first.covariance.diagonal().segment<2>(kGravityTilt).array() += tilt * tilt;
}

FilterState moving_state(const FrontendConfig& config, const NavState& standing, const BentMotion& motion) {
  const Eigen::Vector3d up_body = standing.T_odom_body.rotation.conjugate() * frames::up();
  const Eigen::Vector3d up_force = config.gravity_m * up_body + standing.accel_bias - motion.acceleration;
  const double variance = motion.acceleration_sigma * motion.acceleration_sigma;
  FilterState first = moving_state(config, up_force, variance);
  const Eigen::Matrix3d R = first.nominal.T_odom_body.rotation.toRotationMatrix();
  const Matrix6d& covariance = motion.steady.covariance;
  first.nominal.gyro_bias = -motion.steady.twist.head<3>();
  first.nominal.angular_rate = standing.angular_rate - first.nominal.gyro_bias;
  first.nominal.v_odom = R * motion.steady.twist.tail<3>();
  first.covariance.block<3, 3>(kGyroBias, kGyroBias) = covariance.topLeftCorner<3, 3>();
  first.covariance.block<3, 3>(kVelocity, kVelocity) = R * covariance.bottomRightCorner<3, 3>() * R.transpose();
  return first;
}

std::string describe(const BentMotion& motion) {
  return std::format("scans say that it moves: forward at {:.2f} m/s", -motion.steady.twist[5]);
}

std::string describe(const SteadyMotion& motion) {
  if (!motion.is_rolling()) return "scans agree that it stood";
  return std::format("scans say that it was moving: forward at {:.2f} m/s, turning at {:.3f} rad/s", -motion.twist[5],
                     motion.twist.head<3>().norm());
}

}  // namespace ignis
