// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframes/keyframe_check.h"

#include <cmath>
#include <limits>

namespace ignis {
namespace {

constexpr double kUnitTolerance = 1e-3;
constexpr double kSymmetryTolerance = 1e-6;   // relative to the largest entry
constexpr double kAbsurdPosition = 1e6;       // [m]
constexpr double kAbsurdSpeed = 500.0;        // [m/s]
constexpr double kLeapFreedom = 10.0;         // [m] whatever the interval: a correction of the front end
constexpr double kLeastSpeedVariance = 1e-4;  // [m^2/s^2]
constexpr double kAbsurdBias = 100.0;         // [rad/s] or [m/s^2]
constexpr double kAbsurdVariance = 1e12;      // in units of the state: beyond it the chain's sums mean nothing

std::string sighted_problem(const SightedSpeed& sighted) {
  const bool finite = sighted.axis.allFinite() && std::isfinite(sighted.speed) && std::isfinite(sighted.variance);
  if (!finite) return "the sighted speed is not finite";
  if (std::abs(sighted.axis.norm() - 1.0) > kUnitTolerance) return "the sighted speed's axis is not of unit length";
  if (sighted.variance < kLeastSpeedVariance) return "the sighted speed is known absurdly well";
  return std::abs(sighted.speed) > kAbsurdSpeed ? "the sighted speed is absurd" : "";
}

}  // namespace

std::string keyframe_problem(const Keyframe& keyframe) {
  const NavState& state = keyframe.state;
  if (keyframe.id == std::numeric_limits<std::int32_t>::max()) return "no id can follow this one";
  if (!state.T_odom_body.all_finite()) return "the pose is not finite";
  if (!state.v_odom.allFinite()) return "the velocity is not finite";
  if (!state.gyro_bias.allFinite() || !state.accel_bias.allFinite()) return "a bias is not finite";
  if (!keyframe.covariance.allFinite()) return "the covariance is not finite";
  if (!keyframe.scan_information.allFinite()) return "the scan information is not finite";
  if (std::abs(state.T_odom_body.rotation.norm() - 1.0) > kUnitTolerance) return "the quaternion is not of unit length";
  if (state.T_odom_body.translation.norm() > kAbsurdPosition) return "the position is absurd";
  if (state.v_odom.norm() > kAbsurdSpeed) return "the velocity is absurd";
  if (state.gyro_bias.norm() > kAbsurdBias || state.accel_bias.norm() > kAbsurdBias) return "a bias is absurd";
  if (keyframe.covariance.cwiseAbs().maxCoeff() > kAbsurdVariance) return "the covariance is absurd";
  const Matrix6d& information = keyframe.scan_information;
  const double skewness = (information - information.transpose()).cwiseAbs().maxCoeff();
  if (skewness > kSymmetryTolerance * information.cwiseAbs().maxCoeff()) return "the scan information is not symmetric";
  return keyframe.sighted ? sighted_problem(*keyframe.sighted) : std::string();
}

std::string succession_problem(const Keyframe& keyframe, Utime utime, const Pose& T_odom_body) {
  if (keyframe.state.utime <= utime) return "the stamp does not come after the previous keyframe's";
  const double distance = (keyframe.state.T_odom_body.translation - T_odom_body.translation).norm();
  const double reach = kAbsurdSpeed * seconds_between(utime, keyframe.state.utime) + kLeapFreedom;
  return distance > reach ? "the leap from the previous keyframe is absurd" : "";
}

}  // namespace ignis
