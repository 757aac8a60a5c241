// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "frontend/filter/eskf.h"
#include "frontend/frontend_config.h"
#include "frontend/local_map/local_map.h"
#include "frontend/matching/blind_directions.h"
#include "frontend/matching/degeneracy.h"
#include "frontend/matching/moving_surfaces.h"
#include "frontend/matching/plane_finder.h"
#include "frontend/matching/salient_points.h"
#include "frontend/matching/scan_update.h"
#include "frontend/planes/plane_fit.h"
#include "frontend/scan_stats.h"

namespace ignis {

/// The state after a scan, and what the scan said.
struct MatchResult {
  FilterState filter;  ///< corrected, or the unchanged prediction when the scan was not applied
  ScanStats stats;     ///< reason and figures; stamps are the caller's
  /// What the scan alone says about the pose (sum of h h^T / r) as far as it has corrected the state: along a blind
  /// direction more than the covariance may rely on. The graph would otherwise prefer dead reckoning over a whole
  /// interval to what the filter made of the same samples and the weak structure. Attitude and position both in body
  /// axes. Zero when not applied.
  Matrix6d information_body = Matrix6d::Zero();
  /// The same as sum over the points, order and axes of PoseInformation: what the covariance may rely on.
  PoseInformation reliable;
  /// What certain points add to that along degenerate directions, after it.
  SalientPart salient;
  /// Projects on what `reliable` must not correct: position along directions that it leaves open, and velocity with it.
  ErrorCovariance considered = ErrorCovariance::Zero();
  /// The part of that which `salient` must not correct either: velocity along doubtful axes.
  ErrorCovariance untold_velocity = ErrorCovariance::Zero();
  DegeneracyAnalysis degeneracy;                     ///< which directions that leaves open
  Eigen::Matrix3d facing = Eigen::Matrix3d::Zero();  ///< mean of n n^T over the planes, odom axes
  double map_noise = 1.0;  ///< factor by which the errors of a young map widened the variance of what was matched
  /// Mean age of the map points that the scan met. Times map_noise: all its scans share those errors, so that what one
  /// more of them adds is the part without.
  double map_age_scans = 1.0;
  /// Unit axes (odom) along which the place may be another one that looks alike, see reacquire(). The caller's.
  std::vector<Eigen::Vector3d> doubtful;
  /// By how much its planes disagree on the pose, order of ErrorBlock; see plane_disagreement. Zero when not applied.
  Matrix6d disagreement = Matrix6d::Zero();
};

/// Scans of a map, by their numbers, both included.
struct MapScans {
  int first = 0;
  int last = std::numeric_limits<int>::max();

  [[nodiscard]] bool contain(double scan) const { return first <= scan && scan <= last; }
};

/// What is known of a scan's prediction beside its state.
struct KnownBefore {
  /// The scans of the map whose planes may count as salient. Along a blind direction the pose may have moved against
  /// older ones by more than the matcher reaches, and what it meets then is something else. What newer ones mapped may
  /// have moved along with a velocity that is wrong.
  MapScans salient = {};
  /// Orthonormal axes (odom) along which the place may be a wrong one (see reacquire). The step to it says nothing
  /// about the velocity there: in a wrong place the error of that would be seen by nobody.
  std::span<const Eigen::Vector3d> doubtful = {};
  /// [m^2/s^2, odom axes] What tells moving surfaces from standing ones: with a velocity that is taken for better than
  /// it is, a standing world moves. Where nothing is given the prediction's own.
  std::optional<Eigen::Matrix3d> velocity_covariance = std::nullopt;
};

/// Corrects a predicted state by matching deskewed points against planes of the local map: assessment, quality gate,
/// iterated update, trust region. The map is only read; what is kept from scan to scan is which directions were
/// observed.
class ScanMatcher {
 public:
  explicit ScanMatcher(const FrontendConfig& config);

  /// `T_start`: where to look for planes first; the predicted pose, unless that is too far off (see reacquire).
  [[nodiscard]] MatchResult match(const FilterState& predicted, const Pose& T_start,
                                  std::span<const Eigen::Vector3f> points_body, const LocalMap& map,
                                  const KnownBefore& known = {});

  /// True while surfaces are found to move along a direction that few others face, see MovingSurfaces.
  [[nodiscard]] bool is_restless() const { return moving_surfaces_.is_restless(); }

  /// Points [m, body frame] of the newest scan that met no plane, where its pose was looked for last.
  [[nodiscard]] std::span<const Eigen::Vector3f> unmatched() const { return unmatched_; }

  /// What a few planes said of a shift has been shown to be wrong. From here on shifts that so few observe count as not
  /// observed, and salient points, which may be the same, say nothing.
  void distrust_weak_shifts() { distrusts_weak_shifts_ = true; }

 private:
  /// A point and the plane that it was associated with. The plane stays over the passes until the iterate has moved.
  struct Constraint {
    Eigen::Vector3d point_body;
    PlaneFit plane;         ///< odom axes
    double plane_distance;  ///< [m] of the plane from the origin of odom, along its normal
    double smoothness;      ///< of the plane, (0, 1]: the share of a smooth one's information that it has by itself
    double hearing;         ///< the same, or its strict smoothness where smooth planes suffice, see SmoothSupport
    double weight;          ///< that times the observability weight
  };
  struct Assessment {
    double mean_innovation = 0.0;      ///< [m]
    double expected_innovation = 0.0;  ///< [m] root mean square that the prediction's own covariance explains
    Eigen::Vector3d observability = Eigen::Vector3d::Zero();
    Matrix6d sensitivity = Matrix6d::Zero();   ///< mean of h h^T over the points
    Matrix6d normal_noise = Matrix6d::Zero();  ///< what errors of the normals add to it
  };

  /// Notes what is known without the scan.
  void expect(const FilterState& predicted, const KnownBefore& known);
  void associate(const Pose& pose, std::span<const Eigen::Vector3f> points_body, const LocalMap& map);
  /// A constraint for each point that has a plane; the others are lines or unmatched. `across_lines`: among the points
  /// that are lines, farther off.
  void add_constraints(const Pose& pose, std::span<const Eigen::Vector3f> points_body, const LocalMap& map,
                       bool across_lines);
  /// Where a plane lies along its normal [m]. Of a smooth one all neighbours tell. Where an edge or a corner passes for
  /// a plane, their mean is off to one side, before the edge or behind it, alike in scan after scan: the rougher the
  /// plane, the more is told by the points of the query's own voxel, which lie where the query does.
  [[nodiscard]] double distance_along(const PlaneFit& plane, double smoothness, const Eigen::Vector3d& query,
                                      const Eigen::Vector3d& seen_from, const LocalMap& map) const;
  /// Drops the constraints to surfaces that have moved, where they are among the few that face their way.
  void leave_out_moving_surfaces(int newest_scan);
  /// Drops the constraints to surfaces that the map has held for a moment only, as long as enough is left without them.
  /// What moves is always new where it is. It is a small part of a scan, yet along an aisle whose ends are out of range
  /// a forklift that goes by can be most of what faces along the way, and it says what its own speed is. What stands is
  /// new only when it has just come into sight. A vehicle that does not know its own speed sees all that stands move.
  void leave_out_new_surfaces(int newest_scan);
  /// Where smooth planes hold all directions, edges and corners fall silent, and what is rough by noise alone counts in
  /// full; see SmoothSupport.
  void weigh_rough_planes();
  [[nodiscard]] Assessment assess(const FilterState& predicted);
  void find_observed_directions(const Assessment& assessment, const LocalMap& map);
  void weigh(const Eigen::Vector3d& observability);
  /// Distance of a point from its plane [m] at the pose (R, t).
  [[nodiscard]] static double residual(const Eigen::Matrix3d& R, const Eigen::Vector3d& t,
                                       const Constraint& constraint);
  [[nodiscard]] double inflation() const;
  [[nodiscard]] double point_variance(const Pose& pose) const;
  /// Sums the constraints that `counts` says yes to and that lie within the gate.
  [[nodiscard]] PoseInformation accumulate(const Pose& pose, const Matrix6d& pose_covariance, auto counts) const;
  [[nodiscard]] double mean_residual(const Pose& pose) const;
  /// Of the planes about the corrected pose, but not along blind directions.
  [[nodiscard]] Matrix6d disagreement(const Pose& pose) const;
  [[nodiscard]] ErrorCovariance considered() const;
  /// Steps along the degenerate directions: what certain points say there, then what little the rest does. The
  /// information of both; nothing on numerical failure.
  [[nodiscard]] std::optional<Matrix6d> step_along_degenerate(FilterState& iterate, SalientPart& salient);
  [[nodiscard]] SalientPart find_salient(const FilterState& at);
  [[nodiscard]] bool iterate(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body,
                             const LocalMap& map, MatchResult& result);
  [[nodiscard]] ScanReason judge(const FilterState& predicted, const Assessment& assessment,
                                 const MatchResult& result) const;

  FrontendConfig config_;
  PlaneFinder plane_finder_;
  std::vector<Eigen::Vector3d> queries_;  ///< [m] odom frame; of some points
  std::vector<Constraint> constraints_;
  std::vector<Eigen::Vector3f> lines_;  ///< points whose near neighbours make a line
  std::vector<Eigen::Vector3f> unmatched_;
  DegeneracyAnalysis degeneracy_;
  BlindDirections blind_directions_;
  double map_noise_ = 1.0;  ///< factor on the variance of a point for the map's own errors
  double mean_range_ = 1.0;
  double mean_map_scan_ = 0.0;    ///< number of the scan that a met map point comes from
  double pooled_variance_ = 0.0;  ///< see is_salient
  MapScans salient_scans_;
  /// Projects on what a doubtful place says nothing of, see match().
  ErrorCovariance untold_velocity_ = ErrorCovariance::Zero();
  bool speed_is_known_ = false;
  MovingSurfaces moving_surfaces_;
  std::vector<MatchedSurface> surfaces_;  ///< the constraints as MovingSurfaces wants them
  Pose T_odom_predicted_;                 ///< this and the next: without the scan, whatever the iterate has become
  PriorMotion prior_;
  Utime last_scan_ = 0;         ///< 0: none yet
  double scan_seconds_ = 0.1;   ///< from scan to scan, running mean
  double salient_share_ = 0.0;  ///< of the matched points, running mean over half a second of scans
  bool distrusts_weak_shifts_ = false;

  friend void transfer(auto& io, FieldsOf<ScanMatcher> auto& matcher) {
    transfer(io, matcher.blind_directions_);
    io.number(matcher.salient_share_);
    io.number(matcher.distrusts_weak_shifts_);
    transfer(io, matcher.moving_surfaces_);
    io.number(matcher.last_scan_);
    io.number(matcher.scan_seconds_);
  }
};

}  // namespace ignis
