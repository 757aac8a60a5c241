// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/pose.h"

namespace ignis {

/// What tells an observed direction of the pose from one that only seems so.
struct DegeneracyLimits {
  double length_m = 1.0;               ///< mean range of the points: makes attitude and position comparable
  double min_sensitivity = 0.0;        ///< mean squared sensitivity per point below which a direction is degenerate
  double min_signal_to_noise = 0;      ///< the same, relative to what the errors of the normals alone make of it
  double min_shift_sensitivity = 0.0;  ///< for a direction that is mostly a shift, beside min_sensitivity
};

/// What a scan says of each direction, in coordinates in which all six are of one kind: (length x attitude, position).
struct ScaledSensitivity {
  ScaledSensitivity(const Matrix6d& sensitivity, const Matrix6d& noise, double length_m);

  double length_m;
  Matrix6d value;  ///< mean of h h^T over the matched points, scaled
  Matrix6d noise;  ///< the part of it that errors of the normals explain
};

/// Which directions of a 6-dimensional pose error (attitude in body axes, position in odom axes) a scan observes.
struct DegeneracyAnalysis {
  int degenerate_directions = 0;            ///< 0..6
  Vector6d eigenvalues = Vector6d::Zero();  ///< mean squared sensitivity per point of each direction looked at
  Vector6d noise = Vector6d::Zero();        ///< the part of each that errors of the normals explain
  double length_m = 1.0;                    ///< that scales attitude below
  /// Degenerate unit directions in scaled coordinates: (length x attitude, position).
  std::vector<Vector6d> degenerate;
  /// What a scan may be relied on for: keeps a direction of the pose error by the square root of the share of its
  /// sensitivity that is no noise, and nothing along degenerate directions.
  Matrix6d projector = Matrix6d::Identity();
  /// The same share along degenerate directions alone: a bit of true structure among much noise, worth a correction of
  /// the state but not a claim to know it.
  Matrix6d doubtful = Matrix6d::Zero();
  Matrix6d blind_part = Matrix6d::Zero();  ///< projects a pose error on the degenerate directions
};

/// `sensitivity` is the mean of h h^T over the matched points, h = derivative of the point-to-plane distance; `noise`
/// is the mean of what the errors of the plane normals add to it. A bare corridor's walls have normals that are off by
/// a degree at random: along the corridor they look like many weak constraints, all of which say "no motion". Their
/// expected size is known from the plane fits, so a direction counts as observed only when it shows more than that.
/// Attitude is scaled by the length first, so that all six eigenvalues are of one kind.
/// After: J. Zhang, M. Kaess, S. Singh, "On degeneracy of optimization-based state estimation problems", ICRA 2016, for
/// the projection; the subtraction of the expected noise is the usual correction for errors in variables.
[[nodiscard]] DegeneracyAnalysis analyse_degeneracy(const Matrix6d& sensitivity, const Matrix6d& noise,
                                                    const DegeneracyLimits& limits);

/// Whether a unit direction in scaled coordinates is more a shift than a turn.
[[nodiscard]] bool is_mostly_shift(const Vector6d& direction);

/// The shift alone of a unit direction that is mostly one; any other as it is.
[[nodiscard]] Vector6d without_small_turn(const Vector6d& direction);

/// Which of given orthonormal directions, the columns of `basis`, a scan does not observe; `needed` is the signal to
/// noise that each needs.
[[nodiscard]] std::array<bool, 6> blind_among(const Matrix6d& basis, const ScaledSensitivity& scan,
                                              const std::array<double, 6>& needed, const DegeneracyLimits& limits);

/// Which of the `blind` ones that are mostly shifts turn all the same.
///
/// A blind direction is a shift and a bit of turn. Along a straight corridor the turn is what noise mixes in: the shift
/// alone is as blind. Along a bend of it the turn belongs to the motion, and the shift alone runs into the walls. So
/// that it is a shift alone is believed until a scan contradicts: until the signal of the shift alone exceeds that of
/// the blind motions nearest to it by more than a share of the noise. The noise of the normals is in both and cancels.
[[nodiscard]] std::array<bool, 6> turning_among(const Matrix6d& basis, const std::array<bool, 6>& blind,
                                                const ScaledSensitivity& scan);

/// What a scan says when it does not observe those directions that are `blind`.
///
/// One of them that is mostly a shift and not `turning` is taken for a pure shift, which is what it is: with the
/// attitude fixed, parallel walls say nothing about the way along them. The bit of attitude that noise mixes in would
/// tie the two together, turn the vehicle as it goes and, by gravity, accelerate it.
[[nodiscard]] DegeneracyAnalysis without_blind(const Matrix6d& basis, const ScaledSensitivity& scan,
                                               const std::array<bool, 6>& blind, const std::array<bool, 6>& turning,
                                               double min_sensitivity);

/// The degenerate directions that are shifts, as unit vectors in odom axes.
[[nodiscard]] std::vector<Eigen::Vector3d> blind_shifts(const DegeneracyAnalysis& analysis);

/// Where a point [m, body axes] goes under each of these, as unit vectors in odom axes; `R` turns body into odom axes.
/// Along a bend that is not where the vehicle goes.
void blind_shifts_of_point(const DegeneracyAnalysis& analysis, const Eigen::Matrix3d& R,
                           const Eigen::Vector3d& point_body, std::vector<Eigen::Vector3d>& axes);

/// The same analysis without those shifts along which `information` (of the position, odom axes, [1/m^2]) is better
/// than `sigma_m`: for what is reported.
[[nodiscard]] DegeneracyAnalysis without_known_shifts(DegeneracyAnalysis analysis, const Eigen::Matrix3d& information,
                                                      double sigma_m);

/// What a blind shift adds to the covariance of the other shifts [m^2]. The direction itself is known to a few
/// milliradians only, and a vehicle that is off by metres along a corridor is off by centimetres across it, in a map
/// that has the same error. `position_covariance` in odom axes.
[[nodiscard]] Eigen::Matrix3d tilt_of_blind_shifts(const DegeneracyAnalysis& analysis,
                                                   const Eigen::Matrix3d& position_covariance);

/// The degenerate directions for people: each by its larger part, position in odom axes or attitude in body axes; a
/// shift along a bend with the turn that goes with it. Empty when there are none.
[[nodiscard]] std::string describe(const DegeneracyAnalysis& analysis);

}  // namespace ignis
