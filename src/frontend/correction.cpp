// SPDX-License-Identifier: Apache-2.0
//
// How a scan corrects the filter: where matching begins, and what the covariances that are published take from it.
#include <algorithm>
#include <cmath>

#include "frontend/filter/kalman_step.h"
#include "frontend/filter/scan_instant.h"
#include "frontend/lio.h"
#include "frontend/local_map/voxel_downsample.h"

namespace ignis {
namespace {

constexpr double kVagueSpeed = 0.1;  // m/s: known better, a wall ahead enters the map by itself
// m: what was mapped from that far away is no trail. At 0.2 and 0.3 one drive of a hundred was still led by its own.
constexpr double kBesideItsTrail = 0.5;
constexpr double kSecondsWithoutTrail = 1.5;  // behind a rest
constexpr double kUnevenStep = 0.03;          // m: of the position, beyond what the velocity explains
constexpr double kUnevenSpeed = 0.03;         // m/s

void take_from_velocity(FilterState& filter, const VelocityError& error,
                        const ErrorVector& learns = ErrorVector::Ones()) {
  Eigen::Matrix<double, 1, kErrorSize> derivative = Eigen::Matrix<double, 1, kErrorSize>::Zero();
  derivative.segment<3>(kVelocity) = error.direction.transpose();
  kalman_step<1>(filter, Eigen::Matrix<double, 1, 1>(error.along), derivative,
                 Eigen::Matrix<double, 1, 1>(error.variance), learns);
}

/// Weak shifts may have put the velocity right since, and the position was held to a map that came along with it: the
/// velocity's error now no longer tells the position's.
ErrorVector all_but_position() {
  ErrorVector learns = ErrorVector::Ones();
  learns.segment<3>(kPosition).setZero();
  return learns;
}

/// Beside what the scan does not observe.
void name_doubt(ScanStats& stats, const std::string& doubt) {
  if (!stats.applied() || doubt.empty()) return;
  stats.unobserved += (stats.unobserved.empty() ? "" : "; ") + doubt;
}

}  // namespace

/// `age` [s] is that of the points in the mean: of the position at that instant the scan tells.
MatchResult Lio::correct(const std::vector<CloudPoint>& cloud, const std::vector<CloudPoint>& sparse, double age) {
  MatchResult result;
  result.filter = filter_;
  if (std::ssize(cloud) < config_.min_scan_points) {
    result.stats.reason = ScanReason::kTooFewPoints;
  } else if (!config_.use_scan_matching) {
    result.stats.reason = ScanReason::kMatchingDisabled;
  } else if (map_.empty()) {
    result.stats.reason = ScanReason::kMapEmpty;
  } else {
    const bool is_large = std::ssize(cloud) > config_.max_scan_points;
    every_nth(is_large ? sparse : cloud, config_.max_scan_points, match_points_);
    const Reacquisition place = place_to_begin();
    const FilterState seen{filter_.nominal, with_position_at(filter_.covariance, -age)};
    const KnownBefore known{.salient = salient_scans(),
                            .doubtful = place.doubtful,
                            .velocity_covariance = cautious_.block<3, 3>(kVelocity, kVelocity)};
    result = matcher_.match(seen, place.T_odom_body, match_points_, map_, known);
    result.doubtful = place.doubtful;
    name_doubt(result.stats, place.doubt);
    const Eigen::Vector3d gained = result.filter.nominal.v_odom - filter_.nominal.v_odom;
    result.filter.nominal.T_odom_body.translation += age * gained;
    result.filter.covariance = with_position_at(result.filter.covariance, age);
  }
  return result;
}

/// Where the matcher looks first. The map may lie farther from the points than it sees: nothing was corrected for a
/// while, or the velocity of a moving start is not known yet.
Reacquisition Lio::place_to_begin() const {
  Reacquisition place{.T_odom_body = filter_.nominal.T_odom_body, .doubtful = {}, .doubt = {}};
  const double sees = std::max(config_.match_radius_m, config_.wide_match_radius_m);
  const bool is_far = filter_.covariance.diagonal().segment<3>(kPosition).maxCoeff() > sees * sees;
  const bool was_silent =
      !last_correction_ || seconds_between(*last_correction_, filter_.nominal.utime) > kSecondsUntilReacquisition;
  if (!velocity_known_) {
    if (is_far || was_silent) place.T_odom_body = approached(filter_, match_points_, map_, config_);
  } else if (was_silent) {
    place = reacquire(filter_, match_points_, map_, config_);
  }
  // Ten scans confirm a resumption before anything is built on it: they say more than what the first one leaves open.
  if (trust_.awaits_confirmation()) return {.T_odom_body = place.T_odom_body, .doubtful = {}, .doubt = {}};
  return place;
}

/// What was mapped from near here may be the trail of a velocity that is wrong, which moves along with the pose and
/// vouches for it. A vehicle that rests, or did so a moment ago, leaves none.
MapScans Lio::salient_scans() const {
  MapScans scans{.first = sure_since(config_.match_radius_m)};
  if (!has_rested(kSecondsWithoutTrail))
    scans.last = drift_.newest_beyond(kBesideItsTrail, filter_.nominal.T_odom_body.translation);
  return scans;
}

/// The first scan of the map since which the position has become less certain by no more than `sigma_m`.
int Lio::sure_since(double sigma_m) const {
  return drift_.sure_since(published_position_covariance(), filter_.nominal.T_odom_body.translation, sigma_m);
}

Eigen::Matrix3d Lio::published_position_covariance() const {
  const Matrix6d drift = drift_.pose_covariance(filter_.nominal.T_odom_body);
  return cautious_.block<3, 3>(kPosition, kPosition) + drift.bottomRightCorner<3, 3>();
}

void Lio::count_correction(const FilterState& predicted, const MatchResult& match, double age) {
  if (match.stats.reason == ScanReason::kMapEmpty) last_correction_ = filter_.nominal.utime;  // the map begins here
  if (!match.stats.applied()) return;
  ++applied_scans_;
  last_correction_ = filter_.nominal.utime;
  const Eigen::Matrix3d before = published_position_covariance();
  ErrorCovariance seen = with_position_at(cautious_, -age);
  const UpdateStep update = information_update(seen, ErrorVector::Zero(), match.reliable, match.considered);
  if (update.ok) seen = update.covariance;
  const bool salient = match.salient.constraints.count > 0;
  const UpdateStep along =
      salient ? information_update(seen, ErrorVector::Zero(), match.salient.constraints, match.untold_velocity)
              : UpdateStep{};
  if (along.ok) seen = along.covariance;
  cautious_ = with_position_at(seen, age);
  const Pose& T_odom_body = filter_.nominal.T_odom_body;
  const std::vector<Eigen::Vector3d> blind = blind_shifts(match.degeneracy);
  drift_.hand_over(blind, T_odom_body, cautious_.block<3, 3>(kPosition, kPosition));
  if (salient) drift_.hold_to(match.salient.mean_scan, blind, T_odom_body);
  // What was known before was known of the place that was predicted, not of the one that the scan led to.
  const Eigen::Vector3d shift = T_odom_body.translation - predicted.nominal.T_odom_body.translation;
  const Eigen::Matrix3d about_here = before + shift * shift.transpose();
  drift_.doubt(about_here, match.doubtful, T_odom_body, cautious_.block<3, 3>(kPosition, kPosition));
}

/// Where scans do not observe a direction, walls that are in no map yet tell how fast it goes.
void Lio::heed_sighted_walls(const FilterState& predicted, const MatchResult& match) {
  const std::vector<Eigen::Vector3d> blind = blind_shifts(match.degeneracy);
  const bool believed = config_.salient_sigma > 0.0 && velocity_known_ && match.stats.applied();
  if (!believed || blind.empty() || match.stats.standing || matcher_.is_restless()) {
    sighted_walls_.clear();
    return;
  }
  const Eigen::Vector3d step = filter_.nominal.T_odom_body.translation - predicted.nominal.T_odom_body.translation;
  const Eigen::Vector3d gain = filter_.nominal.v_odom - predicted.nominal.v_odom;
  if (std::ranges::any_of(blind, [&](const Eigen::Vector3d& axis) {
        return std::abs(axis.dot(step)) > kUnevenStep || std::abs(axis.dot(gain)) > kUnevenSpeed;
      })) {
    sighted_walls_.clear();
  }
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& point : matcher_.unmatched()) {
    points.push_back(filter_.nominal.T_odom_body * point.cast<double>());
  }
  sighted_walls_.add_scan(filter_.nominal.utime, points);
  if (!sighted_walls_.is_due()) return;
  for (const Eigen::Vector3d& axis : blind) {
    const double sigma = std::sqrt(axis.dot(cautious_.block<3, 3>(kVelocity, kVelocity) * axis));
    if (sigma < kVagueSpeed) continue;
    const std::optional<VelocityError> error = sighted_walls_.judge(axis, sigma, config_.imu_noise_accel);
    if (!error) continue;
    FilterState cautious{filter_.nominal, cautious_};
    take_from_velocity(cautious, *error, all_but_position());
    cautious_ = cautious.covariance;
    const double speed = error->direction.dot(filter_.nominal.v_odom) - error->along;
    take_from_velocity(filter_, *error);
    keyframer_.add_sighted({.axis = error->direction, .speed = speed, .variance = error->variance},
                           {filter_.nominal, cautious_});
    sighted_walls_.clear();
    return;
  }
}

}  // namespace ignis
