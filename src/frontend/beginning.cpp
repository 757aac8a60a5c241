// SPDX-License-Identifier: Apache-2.0
//
// How Lio begins: with what the IMU and the scans before it say of the motion, or with a velocity that is not known.
#include <cmath>
#include <format>
#include <utility>

#include "frontend/filter/scan_instant.h"
#include "frontend/lio.h"

namespace ignis {
namespace {

constexpr int kScansOfMovingStart = 2;                          // one gives a velocity, the second confirms it
constexpr int kScansToConfirmMotion = 40;                       // of an L1, as long as the second opinion looks back
constexpr int kScansToConfirmSession = 60;                      // and something to go on
constexpr Utime kMostLeadUs = 2 * kMicrosPerSecond;             // of a command to begin anew
constexpr Utime kHandOverUs = 150'000;                          // a scan comes later than the sample at its end
constexpr Utime kMostGatheringUs = kMicrosPerSecond;            // of first scans, which come with gaps
constexpr double kRestLasts = 1.0;                              // s: behind it, it has set off
constexpr double kMotionLasts = 30.0;                           // s: of which nothing was heard
constexpr double kLongestSearch = 30.0;                         // s: for a motion that scans do not tell
constexpr std::int64_t kAskingPeriodUs = 3 * kMicrosPerSecond;  // of scans, which takes a quarter of it

/// The position from which a new map begins is exact by definition.
void define_position(ErrorCovariance& covariance) {
  constexpr double kVariance = 1e-6;  // m^2: keeps the covariance invertible
  covariance.middleRows<3>(kPosition).setZero();
  covariance.middleCols<3>(kPosition).setZero();
  covariance.diagonal().segment<3>(kPosition).setConstant(kVariance);
}

FrontendConfig in_motion(FrontendConfig config) {
  config.start = "moving";
  return config;
}

}  // namespace

const char* Lio::begin_anew_after(Utime utime, std::int32_t session) {
  if (session != session_) return "it is not this session that is to end";
  if (imu_.empty()) return "no IMU data have come, so there is nothing to end";
  if (session_end_ && session_end_->session == session) return "";
  const Utime lead = utime - imu_.newest();
  if (lead < kHandOverUs || lead > kMostLeadUs) return "the stamp is not of the two seconds ahead";
  session_end_ = SessionEnd{session, utime};
  return "";
}

bool Lio::ends_with(Utime sample) const {
  return session_end_ && session_end_->session == session_ && sample > session_end_->utime;
}

/// Scans that wait keep waiting: each has one verdict, whichever session it falls to.
void Lio::begin_anew() {
  const SessionEnd end = *session_end_;
  const std::optional<Utime> newest_scan = last_scan_end_;
  std::deque<Scan> waiting = std::move(pending_);
  reset();
  session_end_ = end;
  last_scan_end_ = newest_scan;
  pending_ = std::move(waiting);
  start_note_ = std::format("new session: {} was ended by a command", end.session);
}

bool Lio::falls_to_ended_session(const Scan& scan) const {
  if (!session_end_ || scan.end_utime() > session_end_->utime) return false;
  const bool has_ended = session_end_->session < session_;
  return has_ended || scan.end_utime() > session_end_->utime - kHandOverUs;
}

ScanResult Lio::verdict_of_ended_session(const Scan& scan) const {
  ScanResult result;
  result.stats.utime = scan.end_utime();
  result.stats.scan_sequence = scan.sequence;
  result.stats.session = session_end_->session;
  result.stats.reason = ScanReason::kSessionEnded;
  return result;
}

/// A vehicle that was lost on its way seldom stops so that its new session can begin, and to the IMU it may well seem
/// to stand: only scans are believed, unless they do not tell for too long.
void Lio::begin_in_motion(std::string note) {
  reset();
  start_note_ = std::move(note);
  if (config_.start == "at_rest") initialisation_in_motion_.emplace(in_motion(config_));
}

/// Behind a time of which too little is known to go on from.
void Lio::begin_behind(double seconds, std::string note) {
  if (still_moves(seconds)) {
    begin_in_motion(std::move(note));
  } else {
    reset();
    start_note_ = std::move(note);
  }
}

/// It goes on as it did when it was last heard of `seconds` ago.
bool Lio::still_moves(double seconds) const {
  return velocity_known_ && !has_rested(kRestLasts) && seconds < kMotionLasts;
}

bool Lio::has_rested(double seconds) const {
  return !has_set_off_ || (last_standstill_ && seconds_between(*last_standstill_, filter_.nominal.utime) < seconds);
}

void Lio::await_start(const ImuSample& sample) {
  if (imu_.samples().size() == 1) {  // the stream has begun, perhaps anew
    initialisation_ = ImuInitialisation(config_);
    if (initialisation_in_motion_) initialisation_in_motion_.emplace(in_motion(config_));
    awaited_since_ = sample.utime;
  }
  start_finding_.clear();  // what scans did not tell before says nothing of what keeps it waiting now
  const std::optional<FilterState> first = initialisation_.add(sample);
  if (initialisation_in_motion_) await_start_in_motion(sample);
  if (running_ || !first) return;
  if (config_.start == "moving") {
    start_moving(*first);
  } else if (!initialisation_in_motion_ || seconds_between(awaited_since_, sample.utime) > kLongestSearch) {
    start(*first, true);
  }
}

void Lio::await_start_in_motion(const ImuSample& sample) {
  const std::optional<FilterState> first = initialisation_in_motion_->add(sample);
  if (!first) return;
  start_moving(*first);
  if (running_) initialisation_ = *initialisation_in_motion_;  // which tells how it started
}

void Lio::start(const FilterState& first, bool at_rest) {
  filter_ = first;
  sound_ = first;
  has_set_off_ = !at_rest;
  if (at_rest && config_.use_scan_matching) ask_scans_or_wait();
  start_motion_ = StartMotion(config_);  // its memory is needed no more
  cautious_ = filter_.covariance;
  live_ = filter_.nominal;
  running_ = true;
  last_correction_ = first.nominal.utime;
  velocity_known_ = at_rest;
  drift_ = MapDrift(config_.map_drift);
  if (!start_note_.empty()) doubt_start();
  opinion_.begin(first.nominal.utime);
  drift_.begin(filter_);
}

/// A vehicle in motion. Dense scans tell its velocity once it goes; of a sparse LiDAR the last second is asked before,
/// and no start is made until it tells.
void Lio::start_moving(const FilterState& first) {
  const Utime now = first.nominal.utime;
  if (!config_.use_scan_matching || start_motion_.has_dense_scans()) {
    start(first, false);
    return;
  }
  if (!start_motion_.has_window_until(now) || start_motion_.newest() < imu_.samples().front().utime) {
    start_finding_ = "waiting for a second of scans";
    return;
  }
  start_finding_ = "start refused, waiting: scans do not tell how fast it goes";
  if (last_asked_ && now - *last_asked_ < kAskingPeriodUs) return;
  last_asked_ = now;
  const std::optional<BentMotion> motion = start_motion_.find_beside(first.nominal, imu_.samples(), config_.gravity_m);
  if (!motion) return;
  start_finding_ = describe(*motion);
  FilterState found = moving_state(config_, first.nominal, *motion);
  found.nominal.utime = start_motion_.newest();
  start_motion_.fill(map_, *motion, found.nominal.T_odom_body);
  start(found, false);
  velocity_known_ = true;
  mapped_velocity_variance_ = velocity_variance(filter_.covariance);
  doubt_start();
  rebuild_live_state();
}

void Lio::ask_scans_or_wait() {
  awaits_scans_ = !start_motion_.has_scans() || filter_.nominal.utime - start_motion_.newest() >= kMostGatheringUs;
  if (awaits_scans_) {
    start_finding_ = "no scans have come yet";
    doubt_start();
  } else {
    ask_scans_for_motion();
  }
}

/// Of a session that is not the first one it is told that it is new, and more has to confirm it.
void Lio::doubt_start() {
  const bool is_first = start_note_.empty();
  trust_.note_uncertain_start(is_first ? start_finding_ : "new session",
                              is_first ? kScansToConfirmMotion : kScansToConfirmSession);
}

/// Scans that begin after the start are asked what those before it would have told, unless the vehicle has left since:
/// then the IMU knows more. True while they are not mapped yet.
bool Lio::gathers_first_scans(const Scan& scan) {
  if (!awaits_scans_) return false;
  if (!gathering_since_) gathering_since_ = scan.end_utime();
  start_motion_.add(scan);
  follow_to(scan.end_utime());
  const bool is_quiet = use_standstill();
  const bool stands = is_quiet || (last_standstill_ && scan.end_utime() - *last_standstill_ < kMostGatheringUs);
  const bool complete =
      start_motion_.has_window_until(scan.end_utime()) || scan.end_utime() - *gathering_since_ > kMostGatheringUs;
  if (stands && !complete) return true;
  awaits_scans_ = false;
  last_correction_ = filter_.nominal.utime;  // the map begins here
  opinion_.begin(filter_.nominal.utime);
  if (stands) {
    trust_.forget_uncertain_start();
    ask_scans_for_motion();
    if (!start_note_.empty()) doubt_start();
  }
  start_motion_ = StartMotion(config_);
  const bool is_rolling = !map_.empty();
  if (is_rolling) cautious_ = filter_.covariance;
  return is_rolling;
}

/// The IMU was quiet, as at any constant speed. A vehicle that rolls begins with the map that its scans agree on: on
/// that of a single one it would settle wherever a few planes fit. Where scans do not tell, it is taken to stand, and
/// doubted.
void Lio::ask_scans_for_motion() {
  const std::optional<SteadyMotion> motion = start_motion_.find();
  start_finding_ = motion ? describe(*motion) : "scans do not tell whether it stood";
  if (motion && !motion->is_rolling()) return;
  doubt_start();
  if (!motion) return;
  has_set_off_ = true;
  set_rolling(filter_, *motion, config_.gravity_m);
  start_motion_.fill(map_, *motion, filter_.nominal.utime, filter_.nominal.T_odom_body);
  mapped_velocity_variance_ = velocity_variance(filter_.covariance);
}

void Lio::follow_moving_start(ScanReason reason) {
  if (velocity_known_) return;
  if (reason == ScanReason::kApplied) {
    // The map holds scans that were deskewed without a velocity: begin it anew with this scan, deskewed properly.
    map_.clear();
    velocity_known_ = applied_scans_ >= kScansOfMovingStart &&
                      largest_axis_sigma(filter_.covariance, kVelocity) < config_.velocity_known_sigma;
  } else if (is_contradiction(reason)) {
    map_.clear();
  }
  if (!map_.empty()) return;
  // What the vehicle went before is not in this map; left in, it would count as a part of the way to the next scan.
  define_position(filter_.covariance);
  define_position(cautious_);
}

}  // namespace ignis
