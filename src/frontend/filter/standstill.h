// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "common/measurements.h"
#include "frontend/filter/eskf.h"

namespace ignis {

/// Windows of this length have to be quiet; between two corrections there is half of one.
inline constexpr Utime kStandstillWindowUs = kMicrosPerSecond / 2;

/// What noise may explain, of the inertial unit and of the velocity.
inline constexpr double kStandstillSigmas = 3.0;

/// What standing says: the velocity was zero a fifth of a second ago, so that a vehicle which has just set off is not
/// held back before its acceleration shows, and so was the turn rate over the half window before that. Order of rows:
/// velocity (odom axes) [m/s], turn rate (body axes) [rad/s].
struct Standstill {
  Vector6d estimate = Vector6d::Zero();  ///< of both; what differs from zero is error
  Eigen::Matrix<double, 6, kErrorSize> derivative =
      Eigen::Matrix<double, 6, kErrorSize>::Zero();  ///< by the error of the state
  Vector6d variance = Vector6d::Zero();              ///< of IMU noise and of `zero_velocity_sigma`
};

/// The filter is sure, by so many sigma, that the vehicle is not at rest.
[[nodiscard]] bool must_move(const FilterState& filter, const FrontendConfig& config,
                             double sigmas = kStandstillSigmas);

/// The velocity is known so badly that nobody can tell standing from rolling.
[[nodiscard]] bool may_move(const FilterState& filter);

/// What rules out that a quiet vehicle stands.
enum class Unless : std::int8_t {
  kItMayRoll,   ///< the filter is not sure that it hardly moves
  kItMustRoll,  ///< the filter is sure that it moves
};

/// Something when the vehicle stood during the half second before `filter.nominal.utime`: IMU quiet within the
/// limits of a start at rest, no turn, no acceleration, and the filter agrees. A steady drive on a smooth floor is as
/// quiet as standing, so the IMU alone never decides.
[[nodiscard]] std::optional<Standstill> find_standstill(std::span<const ImuSample> samples, const FilterState& filter,
                                                        const FrontendConfig& config,
                                                        Unless unless = Unless::kItMayRoll);

/// Kalman update with the measurement "velocity and turn rate = 0" (zero-velocity update; I. Skog et al.,
/// "Zero-velocity detection - an algorithm evaluation", IEEE TBME 57(11), 2010).
void correct_to_standstill(FilterState& filter, const Standstill& standstill);

}  // namespace ignis
