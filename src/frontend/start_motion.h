// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/measurements.h"
#include "common/pose.h"
#include "frontend/eskf.h"
#include "frontend/frontend_config.h"
#include "frontend/local_map.h"
#include "frontend/plane_finder.h"
#include "frontend/scan_selection.h"

namespace ignis {

/// Turn rate [rad/s] and velocity [m/s] of a vehicle that keeps both, in body axes.
struct SteadyMotion {
  Vector6d twist = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Identity();

  /// False where it is too slow to be told from standing.
  [[nodiscard]] bool is_rolling() const;
};

/// Did the vehicle stand before the start, or roll? To the IMU a constant speed is rest, so the last scans are asked.
///
/// Each speed that it may have had puts the points of these scans into one cloud. Under the true one, surfaces that
/// face along the way lie where each scan saw them. Under any other they are smeared, or what is left of them comes
/// from single moments and says nothing of the speed. So from speeds on a grid Gauss-Newton refines the twist, and what
/// the planes that face along the way say of the speed is compared. And what they are made of must not lie at rest
/// where scans of all moments saw it: then it is the sensor's own pattern on what runs along the way. That a cloud is
/// crisp under the right parameters only: M. Sheehan, A. Harrison, P. Newman, "Self-calibration for a 3D laser", IJRR
/// 31(5), 2012.
class StartMotion {
 public:
  explicit StartMotion(const FrontendConfig& config);

  /// The next scan, in time order. What is older than the window is forgotten.
  void add(const Scan& scan);

  /// At the end of the newest scan, when one speed explains the scans far better than all others. Nothing where they
  /// are too few or look alike all along the way, as in a corridor.
  [[nodiscard]] std::optional<SteadyMotion> find();

  /// Puts the scans into an empty map, for a vehicle that is at `T_odom_body` now.
  void fill(LocalMap& map, const SteadyMotion& motion, Utime now, const Pose& T_odom_body);

 private:
  struct Sample {
    Eigen::Vector3d point;  ///< [m] in the body axes of the newest instant, as a twist has it
    double seconds;         ///< since that instant, negative
  };
  struct Look {
    Vector6d step = Vector6d::Zero();  ///< that makes the planes thinner
    Matrix6d covariance = Matrix6d::Identity();
    double facing = 0.0;    ///< [s^2] of points whose planes face along the way: time between the two, squared
    double evidence = 0.0;  ///< what they say of the speed, relative
    std::vector<std::size_t> witnesses;  ///< those points, in samples_
  };
  struct Candidate {
    Vector6d twist;
    Look last;
  };

  void place(const Vector6d& twist);
  [[nodiscard]] double seconds_of(double scan) const;
  [[nodiscard]] Look look(const Vector6d& twist, std::size_t stride);
  [[nodiscard]] std::size_t stride_to(std::size_t points) const;
  [[nodiscard]] Candidate refined(Vector6d twist, int passes, std::size_t stride, std::size_t last_stride);
  [[nodiscard]] std::optional<SteadyMotion> find_rest();
  [[nodiscard]] bool rest_explains(std::span<const std::size_t> witnesses);

  FrontendConfig config_;
  ScanSelector selector_;
  PlaneFinder finder_;
  LocalMap map_;
  std::deque<Scan> scans_;
  std::vector<Sample> samples_;
  std::vector<Eigen::Vector3d> queries_;
};

/// A first state that was found as if at rest, for a vehicle that rolls: what the gyro read was turn and bias, and the
/// mean specific force held what turning at speed feels.
void set_rolling(FilterState& first, const SteadyMotion& motion, double gravity_m);

/// For people.
[[nodiscard]] std::string describe(const SteadyMotion& motion);

}  // namespace ignis
