// SPDX-License-Identifier: Apache-2.0
//
// What Lio makes of a scan once the filter has taken it: how far the pose can be trusted, whether the IMU agrees, and
// whether the vehicle stands.
#include <cmath>

#include "frontend/filter/standstill.h"
#include "frontend/lio.h"

namespace ignis {
namespace {

constexpr double kSigmasToHaveLeft = 5.0;  // before the first scan
// Of a lost filter, what cannot be.
constexpr double kFastestVehicle = 40.0;  // m/s
constexpr double kVaguestSpeed = 5.0;     // m/s, sigma: what dead reckoning is worth nothing with
constexpr double kLargestBias = 5.0;      // sigmas of what is known of it before any drive

}  // namespace

void Lio::note_evidence(const FilterState& predicted, ScanStats stats, const Scan& scan) {
  stats.utime = scan.end_utime();
  const Eigen::Vector3d& position = filter_.nominal.T_odom_body.translation;
  const Eigen::Matrix3d in_map = cautious_.block<3, 3>(kPosition, kPosition);
  const Eigen::Matrix3d since_start = in_map + drift_.shift_since_start(position);
  trust_.note_scan(
      {.stats = stats,
       .position = position,
       .position_sigma = std::sqrt(in_map.diagonal().maxCoeff()),
       .sigma_since_start = std::sqrt(since_start.diagonal().maxCoeff()),
       .velocity_correction = filter_.nominal.v_odom - predicted.nominal.v_odom,
       .acceleration_sigma = std::sqrt(rest_acceleration_covariance(filter_, config_.gravity_m).diagonal().maxCoeff()),
       .restless = matcher_.is_restless()});
}

/// A lost filter can settle in a motion that its own map, drawn along, bears out, and then never comes back.
bool Lio::has_flown_away() const {
  if (!running_ || !velocity_known_ || trust_.trust_now() != Trust::kLost) return false;
  const double sigma = std::sqrt(cautious_.diagonal().segment<3>(kVelocity).maxCoeff());
  return live_.v_odom.norm() > kFastestVehicle || sigma > kVaguestSpeed ||
         filter_.nominal.accel_bias.norm() > kLargestBias * config_.accel_bias_sigma;
}

/// Where scans and the IMU contradict each other along a direction that scans hardly observe, scans are wrong.
void Lio::heed_second_opinion(const FilterState& predicted, const MatchResult& match) {
  if (!match.stats.applied() || !velocity_known_ || learns_nothing() || trust_.awaits_confirmation()) {
    opinion_.forget();
    return;
  }
  opinion_.note_scan({filter_.nominal, cautious_}, filter_.nominal.v_odom - predicted.nominal.v_odom, match.facing);
  const std::optional<Contradiction> contradiction = opinion_.contradiction();
  if (!contradiction || imu_.samples().front().utime > contradiction->since.nominal.utime) return;
  FilterState alone = dead_reckoned(contradiction->since, filter_.nominal.utime);
  // The way that was not seen would be a step of the published pose: it becomes uncertainty. Along all else scans have
  // held the pose, and two seconds of dead reckoning are off by more than they find back from.
  const Eigen::Vector3d& d = contradiction->direction;
  const Pose held = filter_.nominal.T_odom_body;
  const Eigen::Vector3d missed = d * d.dot(alone.nominal.T_odom_body.translation - held.translation);
  alone.nominal.T_odom_body = held;
  alone.covariance.block<3, 3>(kPosition, kPosition) += missed * missed.transpose();
  // Nor did scans teach the bias along it.
  const Eigen::Vector3d untaught = config_.accel_bias_sigma * (alone.nominal.T_odom_body.rotation.conjugate() * d);
  alone.covariance.block<3, 3>(kAccelBias, kAccelBias) += untaught * untaught.transpose();
  filter_ = alone;
  cautious_ = alone.covariance;
  keyframer_.forget_sighted();
  matcher_.distrust_weak_shifts();
  opinion_.forget();
  trust_.note_contradiction();
}

/// At rest velocity is known better than any scan tells, and with it the tilt that would make it grow. A vehicle that
/// stood goes on standing until it may have set off. Before the first scans, which will be asked, it must have.
bool Lio::use_standstill() {
  if (config_.zero_velocity_sigma <= 0.0 || !velocity_known_) return false;
  const FilterState cautious{filter_.nominal, cautious_};
  const bool sets_off = awaits_scans_ ? must_move(cautious, config_, kSigmasToHaveLeft)
                                      : must_move(cautious, config_) || may_move(cautious);
  has_set_off_ = has_set_off_ || sets_off;
  const Unless unless = has_set_off_ ? Unless::kItMayRoll : Unless::kItMustRoll;
  const std::optional<Standstill> standstill = find_standstill(imu_.samples(), cautious, config_, unless);
  if (!standstill) return false;
  has_set_off_ = false;
  // Windows that overlap share the noise of their samples.
  const bool overlaps = last_standstill_ && filter_.nominal.utime - *last_standstill_ < kStandstillWindowUs / 2;
  if (learns_nothing() || overlaps) return true;
  last_standstill_ = filter_.nominal.utime;
  FilterState corrected = cautious;
  correct_to_standstill(corrected, *standstill);
  cautious_ = corrected.covariance;
  correct_to_standstill(filter_, *standstill);
  keyframer_.add_standstill(*standstill);
  return true;
}

}  // namespace ignis
