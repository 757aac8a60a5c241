// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/scan_matcher.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "common/plane_smoothness.h"
#include "common/so3.h"
#include "frontend/filter/regained_view.h"
#include "frontend/planes/plane_jacobian.h"
#include "frontend/planes/square_sum.h"

namespace ignis {
namespace {

constexpr double kConvergedPosition = 1e-4;  // m; below these the next pass would change nothing that matters
constexpr double kConvergedAngle = 1e-5;     // rad
constexpr double kTouch = 0.5;      // component from which a normal touches a world axis; every unit vector touches one
constexpr int kYoungMapScans = 10;  // normals of a map of fewer scans say little about what is observed
// A map of so many points, a second of L1 scans, adds as much to a distance as the point does. NIS of a standing L1 in
// that second: 100 to 200 without this, 2 to 6 of 6 degrees of freedom with it.
constexpr double kNoisyMapPoints = 20'000.0;
constexpr double kKnownSpeed = 0.05;        // m/s, sigma
constexpr double kShareOfNewestScan = 0.1;  // in running means: half a second of scans
constexpr double kKnownShift = 0.1;         // m: a direction that salient points hold so well is not reported as open
// Mean squared sensitivity per point of a shift that planes which are none have held: 0.001 to 0.01 in a bare corridor,
// 0.003 to 0.02 behind a forklift. The door frames of a corridor make 0.03 and more.
constexpr double kWeakShift = 0.02;
constexpr float kPointsOfAMean = 5.0F;       // a voxel of fewer says less about a place than its neighbourhood does
constexpr std::size_t kPointsTogether = 64;  // so many stay in the first-level cache
// Share of the points: with fewer at near planes nothing may hold the tilt, and what tilts makes walls of lone rings.
constexpr double kFewPlanes = 0.1;
constexpr auto kAll = [](const auto&) { return true; };

/// A step of its own from where the iterate is; false on numerical failure.
bool take_step(FilterState& iterate, const PoseInformation& constraints, const ErrorCovariance& considered) {
  const UpdateStep update = information_update(iterate.covariance, ErrorVector::Zero(), constraints, considered);
  if (!update.ok) return false;
  iterate.nominal = perturbed(iterate.nominal, update.step);
  iterate.covariance = update.covariance;
  return true;
}

double largest_sigma(const ErrorCovariance& covariance, ErrorBlock block) {
  const Eigen::Matrix3d part = covariance.block<3, 3>(block, block);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(part, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(solver.eigenvalues()[2], 0.0));
}

}  // namespace

ScanMatcher::ScanMatcher(const FrontendConfig& config)
    : config_(config), plane_finder_(config), moving_surfaces_(config) {
  config::require_valid(config, "frontend");
}

MatchResult ScanMatcher::match(const FilterState& predicted, const Pose& T_start,
                               std::span<const Eigen::Vector3f> points_body, const LocalMap& map,
                               const KnownBefore& known) {
  salient_scans_ = known.salient;
  untold_velocity_.block<3, 3>(kVelocity, kVelocity) = projector_on(known.doubtful);
  speed_is_known_ = largest_sigma(predicted.covariance, kVelocity) < kKnownSpeed;
  expect(predicted, known);
  MatchResult result;
  result.filter = predicted;
  result.filter.nominal.T_odom_body = T_start;
  associate(T_start, points_body, map);
  result.stats.matched = static_cast<int>(constraints_.size());
  if (result.stats.matched < config_.min_matches) {
    result.stats.reason = ScanReason::kTooFewMatches;
    result.filter = predicted;
    return result;
  }
  const Assessment assessment = assess(result.filter);
  blind_directions_.move_to(T_start);
  find_observed_directions(assessment, map);
  const double noise_ratio = kNoisyMapPoints / std::max(static_cast<double>(map.inserted_points()), 1.0);
  map_noise_ = 1.0 + noise_ratio * noise_ratio;
  result.stats.mean_innovation = assessment.mean_innovation;
  result.stats.observability = assessment.observability;
  const bool iterated = iterate(predicted, points_body, map, result);
  result.degeneracy = degeneracy_;
  result.facing = assessment.sensitivity.bottomRightCorner<3, 3>();
  result.map_age_scans = (map.scans() + 1.0 - mean_map_scan_) * map_noise_;
  result.map_noise = map_noise_;
  result.stats.reason = iterated ? judge(predicted, assessment, result) : ScanReason::kNumericalFailure;
  if (!result.stats.applied()) {
    result.filter = predicted;
    result.information_body.setZero();
    result.reliable = {};
    result.salient = {};
  } else {
    result.disagreement = disagreement(result.filter.nominal.T_odom_body);
  }
  const DegeneracyAnalysis open =
      without_known_shifts(degeneracy_, result.salient.constraints.information.bottomRightCorner<3, 3>(), kKnownShift);
  result.stats.degenerate_directions = open.degenerate_directions;
  result.stats.unobserved = describe(open);
  return result;
}

void ScanMatcher::add_constraints(const Pose& pose, std::span<const Eigen::Vector3f> points_body, const LocalMap& map,
                                  bool across_lines) {
  const auto find = across_lines ? &PlaneFinder::find_across_lines : &PlaneFinder::find;
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  for (std::size_t begin = 0; begin < points_body.size(); begin += kPointsTogether) {
    const auto points = points_body.subspan(begin, std::min(kPointsTogether, points_body.size() - begin));
    queries_.clear();
    for (const Eigen::Vector3f& point : points) queries_.emplace_back(R * point.cast<double>() + pose.translation);
    const std::span<const PlaneFit> planes = (plane_finder_.*find)(map, queries_, pose.translation);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PlaneFit& plane = planes[i];
      if (plane.verdict != PlaneVerdict::kPlane) {
        const bool is_line = plane.verdict == PlaneVerdict::kLine && !across_lines && config_.line_match_radius_m > 0.0;
        (is_line ? lines_ : unmatched_).push_back(points[i]);
        continue;
      }
      const double smoothness = plane_smoothness(plane.scatter[0], config_.smooth_plane_m);
      const double distance = distance_along(plane, smoothness, queries_[i], pose.translation, map);
      constraints_.push_back({points[i].cast<double>(), plane, distance, smoothness, smoothness, 1.0});
    }
  }
}

void ScanMatcher::associate(const Pose& pose, std::span<const Eigen::Vector3f> points_body, const LocalMap& map) {
  constraints_.clear();
  unmatched_.clear();
  lines_.clear();
  add_constraints(pose, points_body, map, false);
  if (static_cast<double>(constraints_.size()) < kFewPlanes * static_cast<double>(points_body.size())) {
    add_constraints(pose, lines_, map, true);
  } else {
    unmatched_.insert(unmatched_.end(), lines_.begin(), lines_.end());
  }
  leave_out_moving_surfaces(map.scans());
  leave_out_new_surfaces(map.scans());
  if (config_.enough_smooth_planes > 0.0) weigh_rough_planes();
  double range_sum = 0.0;
  double scan_sum = 0.0;
  double variance_sum = 0.0;
  for (const Constraint& constraint : constraints_) {
    range_sum += constraint.point_body.norm();
    scan_sum += constraint.plane.mean_scan;
    variance_sum += variance_across(constraint.plane);
  }
  const double count = std::max(static_cast<double>(constraints_.size()), 1.0);
  mean_range_ = constraints_.empty() ? 1.0 : std::max(range_sum / count, 0.1);
  mean_map_scan_ = scan_sum / count;
  pooled_variance_ = variance_sum / count;
}

double ScanMatcher::distance_along(const PlaneFit& plane, double smoothness, const Eigen::Vector3d& query,
                                   const Eigen::Vector3d& seen_from, const LocalMap& map) const {
  const double of_all = plane.normal.dot(query + plane.offset);
  if (smoothness == 1.0) return of_all;
  const Eigen::Vector3d view = seen_from - query;
  const bool has_side = config_.map_two_faces && is_side_clear(plane, view);
  const std::optional<Eigen::Vector3d> own =
      map.own_voxel(query, kPointsOfAMean, has_side ? side_of(plane, view) : Eigen::Vector3d::Zero().eval());
  return own ? of_all + (1.0 - smoothness) * (plane.normal.dot(*own) - of_all) : of_all;
}

void ScanMatcher::expect(const FilterState& predicted, const KnownBefore& known) {
  const Utime now = predicted.nominal.utime;
  if (last_scan_ > 0) scan_seconds_ += kShareOfNewestScan * (seconds_between(last_scan_, now) - scan_seconds_);
  T_odom_predicted_ = predicted.nominal.T_odom_body;
  prior_.position_covariance = predicted.covariance.block<3, 3>(kPosition, kPosition);
  prior_.velocity_covariance =
      known.velocity_covariance.value_or(predicted.covariance.block<3, 3>(kVelocity, kVelocity));
  prior_.seconds = last_scan_ > 0 ? seconds_between(last_scan_, now) : 0.0;
  last_scan_ = now;
}

ScanMatcher::Assessment ScanMatcher::assess(const FilterState& predicted) {
  const Pose& pose = predicted.nominal.T_odom_body;
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  const Matrix6d P = predicted.covariance.topLeftCorner<6, 6>();
  Assessment assessment;
  SquareSum sensitivity;
  SquareSum normal_noise;
  for (const Constraint& constraint : constraints_) {
    const Vector6d h = plane_jacobian(R, constraint.point_body, constraint.plane.normal);
    assessment.mean_innovation += std::abs(residual(R, pose.translation, constraint));
    assessment.observability += constraint.plane.normal.cwiseAbs2();
    sensitivity.add(h);
    for (int k = 0; k < 2; ++k) {
      normal_noise.add(plane_jacobian(R, constraint.point_body, constraint.plane.normal_sigma.col(k)));
    }
  }
  const double share = 1.0 / static_cast<double>(constraints_.size());
  assessment.mean_innovation *= share;
  assessment.observability *= share;
  assessment.sensitivity = share * sensitivity.matrix();
  assessment.normal_noise = share * normal_noise.matrix();
  // trace(P S) is the mean of h^T P h over the points.
  assessment.expected_innovation = std::sqrt(std::max((P * assessment.sensitivity).trace(), 0.0));
  weigh(assessment.observability);
  return assessment;
}

void ScanMatcher::find_observed_directions(const Assessment& assessment, const LocalMap& map) {
  const DegeneracyLimits limits{.length_m = mean_range_,
                                .min_sensitivity = config_.degeneracy_threshold,
                                .min_signal_to_noise = config_.degeneracy_signal_to_noise,
                                .min_shift_sensitivity = distrusts_weak_shifts_ ? kWeakShift : 0.0};
  degeneracy_ = blind_directions_.add_scan(assessment.sensitivity, assessment.normal_noise,
                                           map.scans() >= kYoungMapScans, limits);
  if (degeneracy_.degenerate_directions == 0) salient_share_ = 0.0;
}

void ScanMatcher::weigh(const Eigen::Vector3d& observability) {
  // The reference compares with the dominant axis, which starves walls under a large ceiling although they are many. An
  // axis with `full_observability` of all information is trusted in full; 1 gives back the reference's rule.
  const double full = std::min(observability.maxCoeff(), config_.full_observability);
  for (Constraint& constraint : constraints_) {
    double weakest = full;
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(constraint.plane.normal[axis]) > kTouch) weakest = std::min(weakest, observability[axis]);
    }
    const double share = full > 0.0 ? std::max(weakest / full, config_.min_observability) : 1.0;
    constraint.weight = share * constraint.hearing;
  }
}

double ScanMatcher::residual(const Eigen::Matrix3d& R, const Eigen::Vector3d& t, const Constraint& constraint) {
  return constraint.plane.normal.dot(R * constraint.point_body + t) - constraint.plane_distance;
}

double ScanMatcher::inflation() const {
  return degeneracy_.degenerate_directions > 0 ? config_.blind_residual_inflation : config_.residual_inflation;
}

double ScanMatcher::point_variance(const Pose& pose) const {
  if (!config_.adapt_measurement_noise) return config_.measurement_noise;
  // Posterior mean of a variance whose prior is the configured value, worth `noise_prior_points` observations. What is
  // heard for less than its smoothness is still off by what it is, and what is heard for more by as much more: the pose
  // is no surer for either.
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  double squares = 0.0;
  for (const Constraint& constraint : constraints_) {
    const double z = residual(R, pose.translation, constraint);
    squares += std::max(constraint.smoothness, constraint.hearing) * z * z;
  }
  const double sum = config_.noise_prior_points * config_.measurement_noise + inflation() * squares;
  const double variance = sum / (config_.noise_prior_points + static_cast<double>(constraints_.size()));
  return std::min(variance, config_.measurement_noise);
}

PoseInformation ScanMatcher::accumulate(const Pose& pose, const Matrix6d& pose_covariance, auto counts) const {
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  const double gate2 = config_.max_innovation_sigma * config_.max_innovation_sigma;
  const double base_information = 1.0 / (map_noise_ * point_variance(pose));
  SquareSum information;
  PoseInformation sum;
  for (const Constraint& constraint : constraints_) {
    if (!counts(constraint)) continue;
    const Vector6d h = plane_jacobian(R, constraint.point_body, constraint.plane.normal);
    const double z = residual(R, pose.translation, constraint);
    const double weight = base_information * constraint.weight;
    // Most lie within the point's own noise already; what the pose adds to it need not be known then.
    const double sigmas2 = weight * z * z;
    if (sigmas2 > gate2 && sigmas2 > gate2 * (weight * h.dot(pose_covariance * h) + 1.0)) continue;
    information.add(h, weight);
    sum.gradient += weight * z * h;
    ++sum.count;
  }
  sum.information = information.matrix();
  return sum;
}

ErrorCovariance ScanMatcher::considered() const {
  ErrorCovariance blind = untold_velocity_;
  if (!config_.project_degenerate) return blind;
  blind.topLeftCorner<6, 6>() = degeneracy_.blind_part;
  const Eigen::Matrix3d shifts = degeneracy_.blind_part.bottomRightCorner<3, 3>();
  const Eigen::Matrix3d others = Eigen::Matrix3d::Identity() - shifts;
  const Eigen::Matrix3d untold = others * untold_velocity_.block<3, 3>(kVelocity, kVelocity) * others;
  blind.block<3, 3>(kVelocity, kVelocity) = shifts + untold;
  return blind;
}

bool ScanMatcher::iterate(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body,
                          const LocalMap& map, MatchResult& result) {
  FilterState& iterate = result.filter;
  Pose associated_at = iterate.nominal.T_odom_body;
  ErrorCovariance gate_covariance = predicted.covariance;
  result.considered = considered();
  result.untold_velocity = untold_velocity_;
  for (int pass = 0; pass < config_.iterations; ++pass) {
    const Vector6d moved = body_difference(associated_at, iterate.nominal.T_odom_body);
    if (moved.tail<3>().norm() + mean_range_ * moved.head<3>().norm() > 0.5 * config_.voxel_size_m) {
      associate(iterate.nominal.T_odom_body, points_body, map);
      if (static_cast<int>(constraints_.size()) < config_.min_matches) return false;
      (void)assess(iterate);
      associated_at = iterate.nominal.T_odom_body;
    }
    const PoseInformation all = accumulate(iterate.nominal.T_odom_body, gate_covariance.topLeftCorner<6, 6>(), kAll);
    result.reliable = config_.project_degenerate ? all.projected(degeneracy_.projector) : all;
    if (pass == 0) {
      const Innovation innovation = normalised_innovation(predicted.covariance.topLeftCorner<6, 6>(), result.reliable);
      result.stats.nis = innovation.squared;
      result.stats.nis_directions = innovation.directions;
    }
    const UpdateStep update = information_update(predicted.covariance, difference(predicted.nominal, iterate.nominal),
                                                 result.reliable, result.considered);
    if (!update.ok) return false;
    iterate.nominal = perturbed(iterate.nominal, update.step);
    iterate.covariance = update.covariance;
    gate_covariance = update.covariance;

    result.stats.used = all.count;
    if (update.step.segment<3>(kPosition).norm() < kConvergedPosition &&
        update.step.segment<3>(kAttitude).norm() < kConvergedAngle) {
      break;
    }
  }
  Matrix6d used = result.reliable.information;
  // Among things that move, certain points are so only while the prediction finds out which of them do.
  const bool few_are_believed = !distrusts_weak_shifts_ && (speed_is_known_ || !is_restless());
  if (config_.project_degenerate && degeneracy_.degenerate_directions > 0 && few_are_believed) {
    const std::optional<Matrix6d> more = step_along_degenerate(iterate, result.salient);
    if (!more) return false;
    used += *more;
  }
  Matrix6d to_odom = Matrix6d::Identity();
  to_odom.bottomRightCorner<3, 3>() = iterate.nominal.T_odom_body.rotation.toRotationMatrix();
  result.information_body = to_odom.transpose() * used * to_odom;
  const ErrorVector total = difference(predicted.nominal, iterate.nominal);
  result.stats.correction_m = total.segment<3>(kPosition).norm();
  result.stats.correction_rad = total.segment<3>(kAttitude).norm();
  result.stats.velocity_correction = total.segment<3>(kVelocity).norm();
  result.stats.mean_residual = mean_residual(iterate.nominal.T_odom_body);
  return true;
}

SalientPart ScanMatcher::find_salient(const FilterState& at) {
  int found = 0;
  double scan_sum = 0.0;
  const Eigen::Matrix3d R = at.nominal.T_odom_body.rotation.toRotationMatrix();
  std::vector<Eigen::Vector3d> axes;
  const auto counts = [&](const Constraint& constraint) {
    if (!salient_scans_.contain(constraint.plane.mean_scan)) return false;
    blind_shifts_of_point(degeneracy_, R, constraint.point_body, axes);
    const bool salient = is_salient(constraint.plane, axes, pooled_variance_, config_.salient_sigma);
    if (salient) {
      ++found;
      scan_sum += constraint.plane.mean_scan;
    }
    return salient;
  };
  const PoseInformation sum = accumulate(at.nominal.T_odom_body, at.covariance.topLeftCorner<6, 6>(), counts);
  const double share = sum.count / static_cast<double>(constraints_.size());
  salient_share_ += kShareOfNewestScan * (share - salient_share_);
  if (sum.count == 0 || salient_share_ < config_.salient_share) return {};
  return {sum.projected(degeneracy_.blind_part), scan_sum / found};
}

/// Kept apart from the step along all other directions, since a direction that is off by a degree mixes them: what is
/// off across a corridor by millimetres would be made up for by decimetres along it.
std::optional<Matrix6d> ScanMatcher::step_along_degenerate(FilterState& iterate, SalientPart& salient) {
  if (config_.salient_sigma > 0.0) {
    salient = find_salient(iterate);
    if (!take_step(iterate, salient.constraints, untold_velocity_)) return std::nullopt;
  }
  const PoseInformation doubtful =
      accumulate(iterate.nominal.T_odom_body, iterate.covariance.topLeftCorner<6, 6>(), kAll)
          .projected(degeneracy_.doubtful);
  if (!take_step(iterate, doubtful, untold_velocity_)) return std::nullopt;
  return salient.constraints.information + doubtful.information;
}

double ScanMatcher::mean_residual(const Pose& pose) const {
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  double sum = 0.0;
  for (const Constraint& constraint : constraints_) sum += std::abs(residual(R, pose.translation, constraint));
  return constraints_.empty() ? 0.0 : sum / static_cast<double>(constraints_.size());
}

ScanReason ScanMatcher::judge(const FilterState& predicted, const Assessment& assessment,
                              const MatchResult& result) const {
  // A bound is never tighter than what the prediction itself calls likely: after a moving start or a stretch without
  // scans, a large correction is what the covariance announces, not a sign of a bad map.
  const double sigmas = config_.max_innovation_sigma;
  const double innovation_limit = std::max(config_.max_mean_innovation, sigmas * assessment.expected_innovation);
  const double position_limit =
      std::max(config_.max_scan_correction_m, sigmas * largest_sigma(predicted.covariance, kPosition));
  const double velocity_limit =
      std::max(config_.max_scan_velocity_corr, sigmas * largest_sigma(predicted.covariance, kVelocity));
  if (degeneracy_.degenerate_directions == 6) return ScanReason::kUnobservable;
  if (assessment.mean_innovation > innovation_limit) return ScanReason::kInnovationTooLarge;
  // Whatever the prediction was worth, the corrected pose has to fit the map.
  if (result.stats.mean_residual > config_.max_mean_innovation) return ScanReason::kInnovationTooLarge;
  if (result.stats.correction_m > position_limit) return ScanReason::kCorrectionTooLarge;
  if (result.stats.velocity_correction > velocity_limit) return ScanReason::kVelocityCorrectionTooLarge;
  return ScanReason::kApplied;
}

}  // namespace ignis
