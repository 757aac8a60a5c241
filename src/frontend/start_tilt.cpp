// SPDX-License-Identifier: Apache-2.0
#include "frontend/start_tilt.h"

#include <algorithm>
#include <cmath>

namespace ignis {
namespace {

constexpr double kNoiseRate = 0.1;  // rad/s: slower is the gyroscope's own noise, which turns nowhere

}  // namespace

void widen_by_turn(Matrix15d& covariance, const NavState& state, const InertialInput& input, double dt,
                   double accel_bias_sigma) {
  const Eigen::Vector3d up_body = state.T_odom_body.rotation.conjugate() * Eigen::Vector3d::UnitY();
  const double rate = std::abs((input.gyro - state.gyro_bias).dot(up_body));
  const double turned = std::max(rate - kNoiseRate, 0.0) * dt;
  covariance.diagonal().segment<3>(kAccelBias).array() += accel_bias_sigma * accel_bias_sigma * turned;
}

}  // namespace ignis
