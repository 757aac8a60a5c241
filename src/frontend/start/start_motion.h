// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/measurements.h"
#include "common/pose.h"
#include "frontend/frontend_config.h"
#include "frontend/local_map/local_map.h"
#include "frontend/matching/plane_finder.h"
#include "frontend/matching/scan_selection.h"
#include "frontend/start/start_state.h"

namespace ignis {

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

  /// The newest scan has points enough to be laid on the next one, whatever the speed. Otherwise that has to come from
  /// here.
  [[nodiscard]] bool has_dense_scans() const;

  /// There are scans enough to be asked.
  [[nodiscard]] bool has_scans() const;

  /// There are scans of all of the window, and they are those of the time until `now`.
  [[nodiscard]] bool has_window_until(Utime now) const;

  /// End of the newest scan, of which there must be one.
  [[nodiscard]] Utime newest() const { return scans_.back().end_utime(); }

  /// At the end of the newest scan, when one speed explains the scans far better than all others. Nothing where they
  /// are too few or look alike all along the way, as in a corridor.
  [[nodiscard]] std::optional<SteadyMotion> find();

  /// The same for a vehicle that does not keep its motion: what the inertial unit says of turns and accelerations is
  /// taken out first. `standing` is the state at that end with no velocity, in an attitude that is off by what the
  /// acceleration makes of it. gravity_m: [m/s^2].
  [[nodiscard]] std::optional<BentMotion> find_beside(const NavState& standing, std::span<const ImuSample> samples,
                                                      double gravity_m);

  /// Puts the scans that find() was asked about into an empty map, for a vehicle that is at `T_odom_body` now.
  void fill(LocalMap& map, const SteadyMotion& motion, Utime now, const Pose& T_odom_body);

  /// The same at the newest instant, after find_beside().
  void fill(LocalMap& map, const BentMotion& motion, const Pose& T_odom_body);

 private:
  using Motion = Eigen::Matrix<double, 9, 1>;  ///< turn rate, velocity, acceleration (zero unless bends_)
  using MotionMatrix = Eigen::Matrix<double, 9, 9>;

  struct Sample {
    Eigen::Vector3d point;  ///< [m] in the body axes of the newest instant
    double seconds;         ///< since that instant, negative
  };
  struct Look {
    Motion step = Motion::Zero();  ///< that makes the planes thinner; without acceleration unless bends_
    MotionMatrix covariance = MotionMatrix::Identity();
    double facing = 0.0;    ///< [s^2] of points whose planes face along the way: time between the two, squared
    double evidence = 0.0;  ///< what they say of the speed, relative
    std::vector<std::size_t> witnesses;  ///< those points, in samples_
  };
  struct Candidate {
    Motion motion;
    Look last;
  };

  void measure();
  void place(const Motion& motion);
  void fill_placed(LocalMap& map, const Pose& T_odom_newest) const;
  [[nodiscard]] std::optional<Candidate> search();
  [[nodiscard]] double seconds_of(double scan) const;
  [[nodiscard]] Look look(const Motion& motion, std::size_t stride);
  [[nodiscard]] std::size_t stride_to(std::size_t points) const;
  [[nodiscard]] Candidate refined(Motion motion, int passes, std::size_t stride, std::size_t last_stride);
  [[nodiscard]] std::optional<Candidate> find_rest();
  [[nodiscard]] static SteadyMotion told(const Candidate& found);
  [[nodiscard]] bool is_rolling(const Candidate& found) const;
  [[nodiscard]] bool rest_explains(std::span<const std::size_t> witnesses);

  FrontendConfig config_;
  ScanSelector selector_;
  PlaneFinder finder_;
  LocalMap map_;
  std::deque<Scan> scans_;
  bool bends_ = false;             ///< the motion is that beside the inertial unit, and has an acceleration
  std::size_t newest_points_ = 0;  ///< of the newest scan as the sensor gave it
  std::vector<Sample> measured_;   ///< all points of scans_, as if nothing had moved but what the inertial unit told
  std::vector<Sample> samples_;
  std::vector<Eigen::Vector3d> queries_;
};

}  // namespace ignis
