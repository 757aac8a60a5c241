// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "common/measurements.h"
#include "common/nav_state.h"
#include "frontend/frontend_config.h"

namespace ignis {

/// Moves every point of a scan to the body frame at the scan's END, by integrating the IMU backward from the state
/// there. Keeps its memory from scan to scan.
///
/// `samples` are IMU samples in time order; the last one must be at or after the scan's end. Before the first and after
/// the last sample the nearest one holds. Instants outside the scan are clamped into it. The velocity of the state may
/// be wrong or unknown (zero): the result is then compensated for rotation alone, and calling again with the corrected
/// state gives the better cloud.
class Deskewer {
 public:
  /// Replaces what is in `cloud`. gravity_m: [m/s^2].
  void deskew(const Scan& scan, const NavState& state_at_end, std::span<const ImuSample> samples, double gravity_m,
              std::vector<CloudPoint>& cloud);

 private:
  /// Motion over one interval between IMU samples, expressed in the body frame at the scan's end.
  struct Segment {
    Utime begin = 0;
    Utime end = 0;
    Eigen::Matrix3d R_end_begin = Eigen::Matrix3d::Identity();
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();          ///< [rad/s] body axes
    Eigen::Vector3d position = Eigen::Vector3d::Zero();      ///< [m] at begin
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< [m/s] at begin
    Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< [m/s^2]

    [[nodiscard]] static Segment between(const NavState& before, const NavState& after, const NavState& end, double dt);
    /// [m] of the body `dt` seconds after begin.
    [[nodiscard]] Eigen::Vector3d moved(double dt) const;
    [[nodiscard]] Eigen::Matrix3d turned(double dt) const;
    [[nodiscard]] Eigen::Vector3d at(double dt, const Eigen::Vector3d& point) const;
  };

  void find_knots(const Scan& scan, std::span<const ImuSample> samples);
  void find_motion(const Scan& scan, const NavState& end, double gravity_m);

  std::vector<ImuSample> knots_;   ///< samples at the scan's two ends and all between, oldest first
  std::vector<Segment> segments_;  ///< oldest first
};

/// The same for one scan alone.
[[nodiscard]] std::vector<CloudPoint> deskew(const Scan& scan, const NavState& state_at_end,
                                             std::span<const ImuSample> samples, double gravity_m);

}  // namespace ignis
