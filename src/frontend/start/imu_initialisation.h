// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "common/measurements.h"
#include "frontend/filter/eskf.h"
#include "frontend/frontend_config.h"

namespace ignis {

/// First state of a vehicle in motion: roll and pitch from `up_force` [m/s^2, body axes], the specific force without
/// what the motion makes of it, of variance `variance` [m^2/s^4] per axis. Velocity unknown (zero with a wide sigma),
/// biases at their priors, yaw 0, position 0.
[[nodiscard]] FilterState moving_state(const FrontendConfig& config, const Eigen::Vector3d& up_force, double variance);

/// Finds the first state from IMU samples alone: roll and pitch from gravity, gyro bias (at rest), yaw 0, position 0.
/// Pose and heading are exact by definition; that the frame which they define may not be level is gravity's tilt in it.
///
/// At rest: waits for `start_seconds` without motion; refuses, with a reason in words, data that move or that look like
/// wrong units or axes, and goes on waiting. Moving: takes the mean specific force of the same window for gravity,
/// leaves the velocity unknown (zero with a wide sigma) and the biases at their priors.
///
/// Tilt and accelerometer bias are inseparable in one mean specific force, so the first covariance correlates them.
class ImuInitialisation {
 public:
  explicit ImuInitialisation(const FrontendConfig& config);

  /// Takes the next sample (finite, in time order). Returns the first state, at this sample's instant, once it is
  /// known.
  std::optional<FilterState> add(const ImuSample& sample);

  /// What is being waited for, what was refused, or what was done.
  [[nodiscard]] const std::string& report() const { return report_; }

 private:
  struct Window {
    Eigen::Vector3d gyro_mean = Eigen::Vector3d::Zero();
    Eigen::Vector3d accel_mean = Eigen::Vector3d::Zero();
    double gyro_sigma = 0.0;   ///< [rad/s] root of the largest axis variance
    double accel_sigma = 0.0;  ///< [m/s^2]
    double gyro_noise = 0.0;   ///< [rad/s] sigma from successive differences: blind to slow motion
    double accel_noise = 0.0;  ///< [m/s^2] the same
    double gyro_drift = 0.0;   ///< [rad/s] between the means of the two halves
    double accel_drift = 0.0;  ///< [m/s^2] the same
    double seconds = 0.0;
  };

  [[nodiscard]] Window summarise() const;
  /// Empty when the window is at rest; otherwise the reason that it is not.
  [[nodiscard]] std::string refusal(const Window& window) const;
  [[nodiscard]] std::string refusal_in_motion(const Window& window) const;
  [[nodiscard]] std::string scale_refusal(const Window& window) const;
  [[nodiscard]] std::string tilt_refusal(const Window& window, double limit) const;
  [[nodiscard]] FilterState first_state(const Window& window, bool at_rest) const;
  [[nodiscard]] std::string success(const Window& window, const FilterState& state, bool at_rest) const;

  FrontendConfig config_;
  std::deque<ImuSample> samples_;
  std::string report_;
};

}  // namespace ignis
