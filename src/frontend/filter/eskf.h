// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/byte_codec.h"
#include "common/measurement_bytes.h"
#include "common/measurements.h"
#include "common/nav_state.h"
#include "frontend/frontend_config.h"

/// The error-state Kalman filter's nominal state, its error convention and its prediction.
///
/// Convention: the error is ordered as ErrorBlock. Attitude is perturbed on the right, in body axes, R_true = R exp(d);
/// all other blocks add. One step over dt with constant gyro w and accel a (both minus bias) is
///   R' = R exp(w dt),   a_odom = R exp(w dt / 2) a + g,   V' = V + a_odom dt,   P' = P + V dt + a_odom dt^2 / 2,
/// and the transition matrix is the exact derivative of that step, not a truncated continuous model.
/// Equations: J. Sola, "Quaternion kinematics for the error-state Kalman filter", arXiv:1711.02508, with the mid-step
/// attitude in place of the initial one. The direction of g is part of the state, as in W. Xu et al., "FAST-LIO2",
/// arXiv:2107.06829: the first attitude defines frame odom and is exact, so whatever the start's tilt was is gravity's.
/// At rest a tilt cannot be told from an accelerometer bias; the bias turns with the vehicle, the tilt stays.
namespace ignis {

using ErrorVector = Eigen::Matrix<double, kErrorSize, 1>;
using ErrorCovariance = Eigen::Matrix<double, kErrorSize, kErrorSize>;

/// Nominal state and covariance at one instant.
struct FilterState {
  NavState nominal;
  ErrorCovariance covariance = ErrorCovariance::Identity();
};

void transfer(auto& io, FieldsOf<FilterState> auto& filter) {
  transfer(io, filter.nominal);
  io.matrix(filter.covariance);
}

/// Specific force and angular rate, constant over a step. Biased, as measured, body axes.
struct InertialInput {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< [rad/s]
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< [m/s^2]
};

/// Mean of two consecutive samples: the midpoint rule.
[[nodiscard]] InertialInput midpoint(const ImuSample& a, const ImuSample& b);

/// The sample that lies at `utime` on the line between two samples.
[[nodiscard]] ImuSample interpolate(const ImuSample& a, const ImuSample& b, Utime utime);

/// The state moved by an error vector, and the error vector that moves `from` to `to`.
[[nodiscard]] NavState perturbed(const NavState& state, const ErrorVector& error);
[[nodiscard]] ErrorVector difference(const NavState& from, const NavState& to);

/// Nominal prediction over dt [s]. A negative dt is not the inverse; see predict_backward. Stamps are the caller's.
[[nodiscard]] NavState predict_nominal(const NavState& state, const InertialInput& input, double dt, double gravity);

/// The state from which predict_nominal with the same input leads to `state`.
[[nodiscard]] NavState predict_backward(const NavState& state, const InertialInput& input, double dt, double gravity);

/// The map, and with it odom, has turned against gravity by an angle of this covariance [rad^2, odom axes]: what bends
/// away from level must not count as an acceleration (docs/results/honesty.md, Gravity in a map that bends). To first
/// order in the tilt.
void turn_gravity(ErrorCovariance& covariance, const Eigen::Matrix3d& turn);

/// Derivative of the direction of gravity by its tilt.
[[nodiscard]] Eigen::Matrix<double, 3, 2> gravity_direction_by_tilt(const NavState& state);

/// Derivative of predict_nominal with respect to the error of the state.
[[nodiscard]] ErrorCovariance transition(const NavState& state, const InertialInput& input, double dt, double gravity);

/// Nominal and covariance over dt [s]. `noise_scale` multiplies the variance of the white IMU noise; 1 for a healthy
/// sample, more across a gap or while an axis is clipped.
void predict(FilterState& filter, const InertialInput& input, double dt, const FrontendConfig& config,
             double noise_scale = 1.0);

/// Covariance [m^2/s^4] of the acceleration in odom axes that the filter makes of a vehicle at rest: attitude, bias and
/// tilt of gravity together, of which each alone may be far less certain.
[[nodiscard]] Eigen::Matrix3d rest_acceleration_covariance(const FilterState& filter, double gravity);

/// The largest standard deviation of a block's three axes.
[[nodiscard]] double largest_axis_sigma(const ErrorCovariance& covariance, ErrorBlock block);

/// Makes a covariance exactly symmetric. Returns false when it is not finite or a variance is not positive.
[[nodiscard]] bool make_symmetric(ErrorCovariance& covariance);

/// Finite, and positive definite but for rounding.
[[nodiscard]] bool is_covariance(const ErrorCovariance& matrix);

}  // namespace ignis
