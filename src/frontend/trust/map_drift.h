// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <span>

#include "common/pose.h"
#include "frontend/filter/eskf.h"
#include "frontend/filter/regained_view.h"

namespace ignis {

/// How uncertain the local map itself is against the frame that the drive began in.
///
/// The filter's covariance is that of the pose in the map: each scan measures the pose against points that were placed
/// by earlier poses, so their common error never shows in a residual. Without this part the covariance of a drive of a
/// kilometre equals that of standing still.
///
/// A scan that enters the map carries the error of its pose with it. When the map's points are on average `age` scans
/// old, a share of 1 / age of that error stays for good: e_k = mean(e_j over the last 2 x age scans) + n_k is a random
/// walk with a step of n_k / age. Steps are alike for as long as what makes them is, and the variance of the walk grows
/// by that number of scans times n_k^2 / age^2. Noise is alike for some scans, since the filter averages over them.
/// What the planes disagree by (plane_disagreement) is alike for as long as they are in sight, about `age` scans.
///
/// Along a direction that no scan observes nothing is measured against the map: there the filter's covariance says it
/// all while that lasts. Once structure comes back into view, that shrinks against planes which were shifted along with
/// the pose when they were mapped, and what they were off by then stays (hand_over).
///
/// Kept as the covariance of (turn of the map about the body, shift), both in odom axes, at the present position.
class MapDrift {
 public:
  /// `scale`: factor on the variance that a scan leaves behind, and on that by which the map may bend.
  explicit MapDrift(double scale) : scale_(scale) {}

  /// Begins at the first state: the frame is turned against the level one by what gravity's tilt in it may be.
  void begin(const FilterState& first);

  /// A scan entered the map at a pose that is known in the map with `pose_covariance` and about which its planes
  /// disagree by `disagreement` (both in the order of ErrorBlock). The map is made of points of the age `age_scans` on
  /// average. The scan did not observe shifts along the unit axes `blind` (odom).
  void add_scan(const Matrix6d& pose_covariance, const Matrix6d& disagreement, const Pose& T_odom_body,
                double age_scans, std::span<const Eigen::Vector3d> blind);

  /// By how much a map may bend with a scan that enters it at such a pose, as a covariance of its turn [rad^2, odom
  /// axes], for those who take gravity from it. All of the noise counts, however old the map: no drift of the heading
  /// is seen in halls, yet with less of it the attitude in an open hall had a NEES of 6.1.
  [[nodiscard]] Eigen::Matrix3d bend(const Matrix6d& pose_covariance, const Pose& T_odom_body, double age_scans) const;

  /// Remembers how well a position was known [m^2, odom axes, published covariance] when the map's scan number
  /// `scan` was placed there, and which shifts it did not observe. Numbers ascend; a smaller one begins a new map, the
  /// same one again is of a scan that did not enter it. Of what is old only some are kept, of the newest all: without
  /// scans metres of uncertainty can lie between one and the next.
  void remember(int scan, const Eigen::Matrix3d& position_covariance, const Eigen::Vector3d& position,
                std::span<const Eigen::Vector3d> blind);

  /// After a scan that leaves the pose known in the map with `in_map` [m^2, odom axes] and does not observe `blind`
  /// shifts. What came into view along an axis that was blind until now was mapped on the way here, so the position is
  /// not known better along it than it was at the last call of remember().
  void hand_over(std::span<const Eigen::Vector3d> blind, const Pose& T_odom_body, const Eigen::Matrix3d& in_map);

  /// The first scan whose planes are sure to be the ones that are met now: since then the position, of which
  /// `position_covariance` is published now, has become less certain by no more than `sigma_m` along any axis. The tilt
  /// of the start does not count: it turns the map as a whole. Of those that are not remembered none is sure that came
  /// before one that is.
  [[nodiscard]] int sure_since(const Eigen::Matrix3d& position_covariance, const Eigen::Vector3d& position,
                               double sigma_m) const;

  /// The newest scan that was placed at least `distance_m` from `position`; -1 when none that is remembered was.
  [[nodiscard]] int newest_beyond(double distance_m, const Eigen::Vector3d& position) const;

  /// The pose was measured along unit `axes` (odom) against planes that scan number `scan` mapped. What that takes from
  /// the filter's covariance is only known against those planes: along these axes the position is never known better
  /// than it was when they were placed.
  void hold_to(double scan, std::span<const Eigen::Vector3d> axes, const Pose& T_odom_body);

  /// The place that a scan was matched with may be another one along unit `axes` (odom): along them the position is not
  /// known better than with `position_covariance`. In the map it is known with `in_map`, both [m^2, odom axes].
  void doubt(const Eigen::Matrix3d& position_covariance, std::span<const Eigen::Vector3d> axes, const Pose& T_odom_body,
             const Eigen::Matrix3d& in_map);

  /// [m^2] odom axes: what a position is uncertain by beyond that, against the first pose. The tilt of the start does
  /// not count: it turns all alike and loses nobody.
  [[nodiscard]] Eigen::Matrix3d shift_since_start(const Eigen::Vector3d& position) const;

  /// What a pose is uncertain by beyond its covariance in the map; order of ErrorBlock.
  [[nodiscard]] Matrix6d pose_covariance(const Pose& T_odom_body) const;

 private:
  struct Placement {
    int scan = 0;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Matrix3d position_covariance = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d in_map = Eigen::Matrix3d::Zero();  ///< the same without the tilt of the start

    friend void transfer(auto& io, FieldsOf<Placement> auto& placement) {
      io.number(placement.scan);
      io.matrix(placement.position);
      io.matrix(placement.position_covariance);
      io.matrix(placement.in_map);
    }
  };

  void forget_one();
  void carry_to(const Eigen::Vector3d& position);
  [[nodiscard]] Matrix6d at(const Eigen::Vector3d& position) const;
  [[nodiscard]] Eigen::Matrix3d shift_by_tilt(const Eigen::Vector3d& position) const;

  double scale_;
  Matrix6d covariance_ = Matrix6d::Zero();
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();    ///< where covariance_ is meant
  Eigen::Matrix3d start_tilt_ = Eigen::Matrix3d::Zero();  ///< of the frame against the level one [rad^2]
  Eigen::Vector3d start_ = Eigen::Vector3d::Zero();
  RegainedView view_;                 ///< since the last scan, with the published position
  std::deque<Placement> placements_;  ///< every scan at first, the older the fewer; oldest first

  friend void transfer(auto& io, FieldsOf<MapDrift> auto& drift) {
    io.matrix(drift.covariance_);
    io.matrix(drift.position_);
    io.matrix(drift.start_tilt_);
    io.matrix(drift.start_);
    transfer(io, drift.view_);
    io.list(drift.placements_);
  }
};

}  // namespace ignis
