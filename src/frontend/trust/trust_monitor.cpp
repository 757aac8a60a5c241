// SPDX-License-Identifier: Apache-2.0
#include "frontend/trust/trust_monitor.h"

#include <algorithm>
#include <cmath>
#include <format>
#include <utility>

namespace ignis {
namespace {

constexpr int kScansUntilDegraded = 5;      // without a correction
constexpr double kSecondsUntilLost = 2.0;   // without a correction
constexpr double kSilentImuSeconds = 0.1;   // of scan time
constexpr double kSilentScanSeconds = 0.5;  // of inertial time: five scans of a spinning LiDAR
constexpr double kSilentScans = 2.5;        // periods of a slower one
constexpr int kScansToConfirm = 10;         // applied ones, after silence or a loss
constexpr double kOpinionSeconds = 2.0;     // over which scans and IMU are compared
constexpr double kMaxDisagreement = 8.0;    // sigma
constexpr double kStep = 1.0;               // m, in which the way driven is counted
// Of the way driven: what the position's sigma may grow by. In 2 km of a warehouse, where each metre was observed, it
// reached 0.29 m; along a corridor it is metres after 40 m.
constexpr double kUsualDrift = 1e-4;

constexpr double kResidualShare = 0.02;  // of each scan in the running mean
constexpr double kPoorFit = 1.3;

}  // namespace

void TrustMonitor::note_imu(Utime utime) {
  if (newest_imu_ && seconds_without_imu() > kSilentImuSeconds) scans_to_confirm_ = kScansToConfirm;
  newest_imu_ = newest_imu_ ? std::max(*newest_imu_, utime) : utime;
}

void TrustMonitor::note_arrival(Utime scan_end) {
  if (newest_scan_ && scan_end > *newest_scan_) {
    const double interval = seconds_between(*newest_scan_, scan_end);
    scan_period_ = std::min(interval, last_interval_);
    last_interval_ = interval;
  }
  newest_scan_ = newest_scan_ ? std::max(*newest_scan_, scan_end) : scan_end;
  if (!is_out_of_sight(*newest_scan_)) return;
  unseen_ = true;
  scans_to_confirm_ = std::max(scans_to_confirm_, kScansToConfirm);
}

void TrustMonitor::note_scan(const ScanEvidence& evidence) {
  const ScanStats& stats = evidence.stats;
  note_arrival(stats.utime);
  position_sigma_ = evidence.position_sigma;
  sigma_since_start_ = evidence.sigma_since_start;
  follow(evidence.position);
  acceleration_sigma_ = evidence.acceleration_sigma;
  restless_ = evidence.restless;
  last_reason_ = text(stats.reason);
  if (!last_applied_) last_applied_ = stats.utime;
  corrections_.push_back({stats.utime, evidence.velocity_correction});
  while (seconds_between(corrections_.front().utime, stats.utime) > kOpinionSeconds) corrections_.pop_front();
  // The first scan has no map to agree with: that is a beginning, not a fault.
  if (stats.reason == ScanReason::kMapEmpty) {
    last_applied_ = stats.utime;
    return;
  }
  if (!stats.applied()) {
    ++scans_since_applied_;
    return;
  }
  last_applied_ = stats.utime;
  scans_since_applied_ = 0;
  if (resumed_ && !fits_as_before(evidence)) return;
  if (!resumed_)
    usual_residual_ += (usual_residual_ > 0.0 ? kResidualShare : 1.0) * (stats.mean_residual - usual_residual_);
  scans_to_confirm_ = std::max(scans_to_confirm_ - 1, 0);
  if (scans_to_confirm_ > 0) return;
  lost_.clear();
  unseen_ = false;
  // What closed the gap says nothing about how scans and IMU agree.
  if (resumed_) corrections_.clear();
  resumed_ = false;
  uncertain_start_.clear();
  contradicted_ = false;
}

void TrustMonitor::note_uncertain_start(std::string reason, int scans) {
  uncertain_start_ = std::move(reason);
  scans_to_confirm_ = scans;
}

void TrustMonitor::forget_uncertain_start() {
  uncertain_start_.clear();
  scans_to_confirm_ = 0;
}

void TrustMonitor::note_resumption() {
  resumed_ = true;
  unseen_ = unseen_ || (newest_imu_ && is_out_of_sight(*newest_imu_));
  // The gap is known: how long no scan has come, or fitted, counts from the next one on.
  newest_scan_.reset();
  last_applied_.reset();
  scans_to_confirm_ = kScansToConfirm;
  corrections_.clear();
}

void TrustMonitor::note_contradiction() {
  contradicted_ = true;
  scans_to_confirm_ = kScansToConfirm;
  corrections_.clear();
}

void TrustMonitor::note_loss(std::string reason) {
  lost_ = std::move(reason);
  resumed_ = false;
  ++losses_;
  scans_to_confirm_ = kScansToConfirm;
  corrections_.clear();
}

/// In a place that only looks like the right one a scan finds planes, too, but lies in them less well, and what does
/// not lie where it should seems to move.
bool TrustMonitor::fits_as_before(const ScanEvidence& evidence) const {
  const bool is_thin = usual_residual_ <= 0.0 || evidence.stats.mean_residual < kPoorFit * usual_residual_;
  return is_thin && !evidence.restless;
}

void TrustMonitor::follow(const Eigen::Vector3d& position) {
  const double step = (position - mark_).norm();
  if (step < kStep) return;
  driven_m_ += step;
  mark_ = position;
}

/// [m] against the first pose, up to which a pose is OK.
double TrustMonitor::usual_sigma() const { return config_.degraded_sigma_m + kUsualDrift * driven_m_; }

double TrustMonitor::seconds_without_imu() const {
  return newest_imu_ && newest_scan_ ? seconds_between(*newest_imu_, *newest_scan_) : 0.0;
}

double TrustMonitor::seconds_since_arrival() const {
  return newest_imu_ && newest_scan_ ? seconds_between(*newest_scan_, *newest_imu_) : 0.0;
}

bool TrustMonitor::scans_are_silent() const {
  return seconds_since_arrival() > std::max(kSilentScanSeconds, kSilentScans * scan_period_);
}

bool TrustMonitor::is_out_of_sight(Utime at) const {
  return last_applied_ && seconds_between(*last_applied_, at) > kSecondsUntilLost;
}

double TrustMonitor::disagreement() const {
  if (corrections_.size() < 2) return 0.0;
  const double seconds = seconds_between(corrections_.front().utime, corrections_.back().utime);
  if (seconds < 0.5 * kOpinionSeconds) return 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Correction& correction : corrections_) sum += correction.velocity;
  // A tilt error acts like a bias; its prior bounds what either can do.
  const double bias = std::max(acceleration_sigma_, 0.5 * config_.accel_bias_sigma) * seconds;
  const double white = config_.imu_noise_accel * std::sqrt(seconds);
  return sum.norm() / std::hypot(bias, white);
}

Trust TrustMonitor::trust() const {
  if (!lost_.empty() || unseen_ || position_sigma_ > config_.lost_sigma_m) return Trust::kLost;
  if (scans_since_applied_ >= kScansUntilDegraded || position_sigma_ > config_.degraded_sigma_m ||
      sigma_since_start_ > usual_sigma() || seconds_without_imu() > kSilentImuSeconds || scans_to_confirm_ > 0 ||
      disagreement() > kMaxDisagreement || restless_) {
    return Trust::kDegraded;
  }
  return Trust::kOk;
}

Trust TrustMonitor::trust_now() const {
  if (!scans_are_silent()) return trust();
  return std::max(trust(), is_out_of_sight(*newest_imu_) ? Trust::kLost : Trust::kDegraded);
}

std::string TrustMonitor::reason() const {
  if (!lost_.empty()) return std::format("lost: {} ({} applied scans to go)", lost_, scans_to_confirm_);
  if (scans_are_silent()) {
    return std::format("no scan for {:.1f} s, going on with the IMU alone", seconds_since_arrival());
  }
  if (position_sigma_ > config_.degraded_sigma_m) {
    return std::format("position sigma {:.2f} m (limit {:.2f}): a direction is not observed", position_sigma_,
                       config_.degraded_sigma_m);
  }
  if (scans_since_applied_ >= kScansUntilDegraded) return std::format("no scan applied: {}", last_reason_);
  if (unseen_) {
    return std::format("lost: no scan had fitted for {:.0f} s ({} applied scans to go)", kSecondsUntilLost,
                       scans_to_confirm_);
  }
  if (seconds_without_imu() > kSilentImuSeconds) {
    return std::format("no IMU data for {:.1f} s, going on with scans alone", seconds_without_imu());
  }
  const bool disagree = disagreement() > kMaxDisagreement;
  if (!disagree && !uncertain_start_.empty()) {
    return std::format("{}, {} applied scans to go", uncertain_start_, scans_to_confirm_);
  }
  if (resumed_)
    return std::format("resumed after a restart or a silence of both streams, {} applied scans to go",
                       scans_to_confirm_);
  if (contradicted_) {
    return std::format("scans took back a velocity that the IMU is sure of, it was restored ({} applied scans to go)",
                       scans_to_confirm_);
  }
  if (scans_to_confirm_ > 0 && uncertain_start_.empty())
    return std::format("IMU data are back, {} applied scans to go", scans_to_confirm_);
  if (disagree) {
    return std::format("scan motion and IMU motion disagree by {:.0f} sigma over {:.0f} s", disagreement(),
                       kOpinionSeconds);
  }
  if (restless_) return "most of what faces along the way moves: the way is dead reckoned";
  if (sigma_since_start_ > usual_sigma()) {
    return std::format("position sigma since the start {:.2f} m (limit {:.2f}): a part of the way was not observed",
                       sigma_since_start_, usual_sigma());
  }
  return losses_ > 0 ? std::format("OK, found again after {} losses", losses_) : "OK";
}

}  // namespace ignis
