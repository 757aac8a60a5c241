// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "common/measurements.h"
#include "frontend/eskf.h"

namespace ignis {

/// Windows of this length have to be quiet; between two corrections there is half of one.
inline constexpr Utime kStandstillWindowUs = kMicrosPerSecond / 2;

/// What standing says about the velocity: it was zero a tenth of a second ago. A vehicle that has just set off is
/// so not held back before its acceleration shows.
struct Standstill {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s] estimated for that instant, odom axes
  Eigen::Matrix<double, 3, 15> derivative = Eigen::Matrix<double, 3, 15>::Zero();  ///< of it, by the error of the state
  double variance = 0.0;  ///< [m^2/s^2] per axis, of IMU noise between then and now and of `zero_velocity_sigma`
};

/// Something when the vehicle stood during the half second before `filter.nominal.utime`: IMU quiet within the
/// limits of a start at rest, no turn, no acceleration, and the filter is sure that it hardly moves. A steady drive on
/// a smooth floor is as quiet as standing, so the IMU alone never decides.
[[nodiscard]] std::optional<Standstill> find_standstill(std::span<const ImuSample> samples, const FilterState& filter,
                                                        const FrontendConfig& config);

/// Kalman update with the measurement "velocity = 0" (zero-velocity update; I. Skog et al., "Zero-velocity detection -
/// an algorithm evaluation", IEEE TBME 57(11), 2010). Joseph form: the covariance stays positive.
void correct_to_standstill(FilterState& filter, const Standstill& standstill);

}  // namespace ignis
