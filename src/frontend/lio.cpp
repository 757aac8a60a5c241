// SPDX-License-Identifier: Apache-2.0
#include "frontend/lio.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "frontend/filter/scan_instant.h"
#include "frontend/local_map/voxel_downsample.h"

namespace ignis {
namespace {

constexpr std::size_t kMaxPendingScans = 40;               // two seconds of L1 scans without IMU
constexpr std::int32_t kMaxScanDurationUs = 500'000;       // longer is not a scan but a broken stamp
constexpr std::int64_t kMinScanPeriodUs = 8'000;           // of scans that are worth the time that matching takes
constexpr std::int64_t kMaxLeadUs = 2 * kMicrosPerSecond;  // further ahead of the IMU is a broken stamp
constexpr int kScansOfASettledMap = 40;                    // two seconds: an L1 has then looked everywhere
// Two samples of a vehicle that shakes by 1 m/s^2 stand for all that are missing: beyond this, for more than 0.03 m/s.
constexpr double kGapThatTellsNothing = 0.05;
constexpr double kDeskewTolerance = 0.005;  // m: half the noise of a range

/// What hits the sensor does not move the vehicle as it says: the mount springs back.
bool is_shock(const ImuSample& sample, const FrontendConfig& config) {
  const auto exceeds = [](double value, double limit) { return limit > 0.0 && value > limit; };
  return exceeds(std::abs(sample.accel.norm() - config.gravity_m), config.shock_accel_m_s2) ||
         exceeds(sample.gyro.norm(), config.shock_gyro_rad_s);
}

}  // namespace

Lio::Lio(const FrontendConfig& config, std::int32_t session, std::string note)
    : config_(config),
      session_(session),
      initialisation_(config),
      start_motion_(config),
      selector_(config),
      matcher_(config),
      map_(config),
      drift_(config.map_drift),
      keyframer_(config, session),
      trust_(config),
      opinion_(config),
      start_note_(std::move(note)) {}

void Lio::reset() {
  ++session_;
  imu_ = ImuBuffer();
  initialisation_ = ImuInitialisation(config_);
  initialisation_in_motion_.reset();
  awaited_since_ = 0;
  start_motion_ = StartMotion(config_);
  start_finding_.clear();
  awaits_scans_ = false;
  gathering_since_.reset();
  last_asked_.reset();
  matcher_ = ScanMatcher(config_);
  map_.clear();
  keyframer_ = Keyframer(config_, session_);
  pending_.clear();
  last_scan_end_.reset();
  running_ = false;
  filter_ = FilterState();
  live_ = NavState();
  velocity_known_ = false;
  mapped_velocity_variance_ = 0.0;
  applied_scans_ = 0;
  contradictions_ = 0;
  last_correction_.reset();
  trust_ = TrustMonitor(config_);
  opinion_ = SecondOpinion(config_);
  last_clipped_.reset();
  last_standstill_.reset();
  resumed_from_.reset();
  gap_end_.reset();
  scans_since_gap_ = 0;
  unaided_.reset();
  session_end_.reset();
}

LioStatus Lio::status() const {
  LioStatus status;
  status.running = running_;
  status.text = start_text();
  status.trust = running_ ? trust_.trust_now() : Trust::kDegraded;
  status.reason = running_ ? trust_.reason() : start_note_.empty() ? status.text : start_note_ + "; " + status.text;
  return status;
}

/// A start in motion that the scans were asked about is theirs to tell: the IMU knows no velocity.
std::string Lio::start_text() const {
  if (!running_ && initialisation_in_motion_) {
    return start_finding_.empty() ? initialisation_in_motion_->report() : start_finding_;
  }
  if (start_finding_.empty()) return initialisation_.report();
  if (config_.start == "moving") return running_ ? "started moving: " + start_finding_ : start_finding_;
  return initialisation_.report() + "; " + start_finding_;
}

ImuResult Lio::add_imu(const ImuSample& sample) {
  ImuResult result;
  if (resumed_from_) close_gap(sample.utime);
  const std::optional<Utime> before = imu_.empty() ? std::nullopt : std::optional(imu_.newest());
  ImuSample believed = sample;
  believed.saturated = sample.saturated || is_shock(sample, config_);
  result.fault = imu_.add(believed);
  if (result.fault != ImuFault::kNone) return result;
  if (confirmation_failed(sample.utime)) {
    give_up_resumption(sample.utime, result.scans);
    return result;
  }
  if (has_flown_away()) {
    refuse_pending(result.scans);
    begin_in_motion("new session: lost, and what it took for its motion cannot be");
    return result;
  }
  const Silence silence = before ? bridge_silence(*before, sample.utime, result.scans) : Silence::kNone;
  if (silence == Silence::kTooLong) return result;
  if (ends_with(sample.utime)) {
    begin_anew();
    return result;
  }
  trust_.note_imu(sample.utime);
  const bool is_behind_a_gap = before && seconds_between(*before, sample.utime) > kGapThatTellsNothing;
  if (believed.saturated || is_behind_a_gap) last_clipped_ = sample.utime;

  if (running_ && silence == Silence::kNone) {
    const std::size_t last = imu_.samples().size() - 1;
    const ImuSample& previous = imu_.samples()[last - 1];
    live_ = predict_nominal(live_, midpoint(previous, sample), seconds_between(previous.utime, sample.utime),
                            config_.gravity_m);
    live_.utime = sample.utime;
  } else if (!running_) {
    await_start(sample);
  }
  std::ranges::move(process_pending(), std::back_inserter(result.scans));
  if (running_) {
    commit_to(sample.utime - to_micros(config_.max_scan_delay_s));
    result.state = live_;
  }
  forget_old_samples();
  return result;
}

std::vector<ScanResult> Lio::add_scan(Scan scan) {
  const bool broken = scan.duration_us < 0 || scan.duration_us > kMaxScanDurationUs ||
                      (last_scan_end_ && scan.end_utime() <= *last_scan_end_) ||
                      (!imu_.empty() && scan.end_utime() > imu_.newest() + kMaxLeadUs);
  std::vector<ScanResult> results;
  if (resumed_from_) {
    results.push_back(refuse(scan, ScanReason::kNoImu));
    return results;
  }
  if (broken) {
    results.push_back(refuse(scan, ScanReason::kBadStamp));
    return results;
  }
  if (comes_too_soon(scan)) {
    results.push_back(refuse(scan, ScanReason::kTooOften));
    return results;
  }
  last_scan_end_ = scan.end_utime();
  trust_.note_arrival(scan.end_utime());
  pending_.push_back(with_times(std::move(scan)));
  coast_to(*last_scan_end_ - to_micros(config_.imu_timeout_s));
  results = process_pending();
  forget_old_samples();  // those made up while the IMU is silent, too
  if (pending_.size() > kMaxPendingScans) {
    results.push_back(refuse(pending_.front(), ScanReason::kNoImu));
    pending_.pop_front();
  }
  return results;
}

std::vector<ScanResult> Lio::process_pending() {
  std::vector<ScanResult> results;
  // Came before the first inertial sample, when nothing was known that its stamp could be held against.
  if (!pending_.empty() && !imu_.empty() && pending_.front().end_utime() > imu_.newest() + kMaxLeadUs) {
    results.push_back(refuse(pending_.front(), ScanReason::kBadStamp));
    pending_.pop_front();
    last_scan_end_.reset();
  }
  while (!pending_.empty() && !imu_.empty() && pending_.front().end_utime() <= imu_.newest()) {
    const Scan& scan = pending_.front();
    results.push_back(falls_to_ended_session(scan) ? verdict_of_ended_session(scan) : process(scan));
    pending_.pop_front();
  }
  if (running_ && !results.empty()) rebuild_live_state();
  return results;
}

ScanResult Lio::refuse(const Scan& scan, ScanReason reason) const {
  ScanResult result;
  result.stats.utime = scan.end_utime();
  result.stats.scan_sequence = scan.sequence;
  result.stats.session = session_;
  result.stats.reason = reason;
  result.stats.T_odom_body = filter_.nominal.T_odom_body;
  result.stats.map_points = map_.size();
  return result;
}

void Lio::refuse_pending(std::vector<ScanResult>& refused) {
  for (const Scan& scan : pending_) refused.push_back(refuse(scan, ScanReason::kNoImu));
  pending_.clear();
}

/// Scans of one sensor follow one another. More of them would cost time and say what the last one said.
bool Lio::comes_too_soon(const Scan& scan) const {
  if (!last_scan_end_) return false;
  const bool overlaps = scan.utime < *last_scan_end_ - scan.duration_us / 2;
  return overlaps || scan.end_utime() - *last_scan_end_ < kMinScanPeriodUs;
}

std::vector<CloudPoint> Lio::register_points(const Scan& scan) {
  std::vector<CloudPoint> cloud;
  if (config_.deskew) {
    deskewer_.deskew(scan, filter_.nominal, imu_.samples(), config_.gravity_m, cloud);
    return cloud;
  }
  cloud.reserve(scan.points.size());
  for (const ScanPoint& point : scan.points) cloud.push_back({point.position, point.intensity});
  return cloud;
}

ScanResult Lio::process(const Scan& scan) {
  if (!running_) {
    start_motion_.add(scan);
    return refuse(scan, ScanReason::kNotInitialised);
  }
  if (scan.end_utime() < filter_.nominal.utime) {
    return refuse(scan, applied_scans_ == 0 ? ScanReason::kNotInitialised : ScanReason::kBadStamp);
  }
  mend_filter();
  if (gathers_first_scans(scan)) return refuse(scan, ScanReason::kNotInitialised);
  follow_to(scan.end_utime());
  const ScanSelection& selection = selector_.select(scan);
  std::vector<CloudPoint> cloud = register_points(selection.scan);
  const FilterState predicted = filter_;
  std::vector<CloudPoint> sparse = voxel_downsample(cloud, config_.voxel_size_m, thinner_);
  const double age = config_.deskew ? mean_age(selection.scan) : 0.0;
  const double seen_age = age * new_share(filter_.covariance, mapped_velocity_variance_);
  MatchResult match = correct(cloud, sparse, seen_age);
  match.stats.points = selection.in_range;
  match.stats.unread = selection.unread;
  match.stats.of_one_instant = is_of_one_instant(scan);
  filter_ = match.filter;
  if (learns_nothing()) keep_biases(predicted);
  count_correction(predicted, match, seen_age);
  if (age * (filter_.nominal.v_odom - predicted.nominal.v_odom).norm() > kDeskewTolerance) {
    cloud = register_points(selection.scan);
    sparse = voxel_downsample(cloud, config_.voxel_size_m, thinner_);
  }
  match.stats.standing = use_standstill();
  heed_sighted_walls(predicted, match);
  note_evidence(predicted, match.stats, scan);
  heed_second_opinion(predicted, match);
  seek_confirmation(match.stats.reason);
  match.stats.imu_disagreement = trust_.disagreement();
  follow_moving_start(match.stats.reason);
  enter_map(cloud, match);
  return result_of(scan, match, std::move(cloud), std::move(sparse));
}

/// What is told of a scan, once the filter has taken it: states and covariance as published, and the keyframe if one is
/// due.
ScanResult Lio::result_of(const Scan& scan, const MatchResult& match, std::vector<CloudPoint> cloud,
                          std::vector<CloudPoint> sparse) {
  ScanResult result;
  result.stats = match.stats;
  result.stats.utime = scan.end_utime();
  result.stats.scan_sequence = scan.sequence;
  result.stats.session = session_;
  result.stats.T_odom_body = filter_.nominal.T_odom_body;
  result.stats.map_points = map_.size();
  result.has_state = true;
  result.state = filter_.nominal;
  FilterState published{filter_.nominal, cautious_};
  published.covariance.topLeftCorner<6, 6>() += drift_.pose_covariance(filter_.nominal.T_odom_body);
  auto position_covariance = published.covariance.block<3, 3>(kPosition, kPosition);
  position_covariance += tilt_of_blind_shifts(match.degeneracy, position_covariance);
  const std::vector<Eigen::Vector3d> blind = blind_shifts(match.degeneracy);
  drift_.remember(map_.scans(), position_covariance, filter_.nominal.T_odom_body.translation, blind);
  result.covariance = published.covariance.topLeftCorner<15, 15>();
  if (match.stats.applied() && config_.deskew) {
    result.covariance.diagonal().segment<3>(kAttitude).array() +=
        unseen_turn_variance(config_.imu_noise_gyro, 1e-6 * scan.duration_us);
  }
  result.trust = trust_.trust();
  if (velocity_known_) {
    std::vector<Eigen::Vector3d> untold = blind;
    for (const Eigen::Vector3d& axis : match.doubtful) add_axis(untold, axis);
    result.keyframe =
        keyframer_.add_scan(published, match.information_body, untold, std::move(sparse), keyframe_pace());
  }
  result.cloud = std::move(cloud);
  return result;
}

KeyframePace Lio::keyframe_pace() const {
  if (trust_.awaits_confirmation()) return KeyframePace::kNone;
  return trust_.trust() == Trust::kLost ? KeyframePace::kSeldom : KeyframePace::kAsDriven;
}

/// Standing shows nothing new, and a map that went on taking scans would by and by follow whatever the pose does.
void Lio::enter_map(const std::vector<CloudPoint>& cloud, const MatchResult& match) {
  if (trust_.awaits_confirmation()) return;
  if (match.stats.applied()) {
    if (match.stats.standing && map_.scans() >= kScansOfASettledMap) return;
    // The covariance of a pose in a young map holds the map's noise, which must not be left behind in it once more, and
    // the gyro's, which is: the root lies between (docs/results/accuracy.md, The heading of a young map). Gravity is
    // doubted by the smaller of the two: with the larger one sixteen beams lost their way.
    const double noise = std::sqrt(match.map_noise);
    const double age = match.map_age_scans / noise;
    const Pose& T_odom_body = filter_.nominal.T_odom_body;
    const Matrix6d in_map = cautious_.topLeftCorner<6, 6>();
    drift_.add_scan(in_map, match.disagreement, T_odom_body, age, blind_shifts(match.degeneracy));
    const Eigen::Matrix3d bend = drift_.bend(in_map, T_odom_body, age) / noise;
    turn_gravity(filter_.covariance, bend);
    turn_gravity(cautious_, bend);
  }
  grow_map(cloud, match);
}

void Lio::grow_map(const std::vector<CloudPoint>& cloud, const MatchResult& match) {
  const ScanReason reason = match.stats.reason;
  if (reason == ScanReason::kTooFewPoints) return;
  contradictions_ = is_contradiction(reason) ? contradictions_ + 1 : 0;
  if (contradictions_ >= config_.reanchor_scans) begin_new_map("scans contradicted the map, a new one was begun");
  const bool confirmed = contradictions_ == 0 || map_.empty() || !config_.quarantine;
  if (map_.empty() || match.stats.applied()) {
    const double share = map_.empty() ? 1.0 : 1.0 / std::max(match.map_age_scans, 1.0);
    mapped_velocity_variance_ += share * (velocity_variance(filter_.covariance) - mapped_velocity_variance_);
  }
  map_.insert(cloud, filter_.nominal.T_odom_body, confirmed);
  map_.slide(filter_.nominal.T_odom_body.translation, sure_since(config_.map_memory_sigma_m));
}

/// Of a filter that is none any more nothing is used: from where it was sound the IMU leads on, and since nobody knows
/// what it did to the map, a new session begins.
void Lio::mend_filter() {
  if (is_sound()) {
    sound_ = filter_;
    return;
  }
  const Utime now = filter_.nominal.utime;
  // What was sound longer ago than samples are kept goes on from the oldest of them.
  sound_.nominal.utime = std::max(sound_.nominal.utime, imu_.samples().front().utime);
  filter_ = dead_reckoned(sound_, now);
  cautious_ = filter_.covariance;
  matcher_ = ScanMatcher(config_);
  drift_ = MapDrift(config_.map_drift);
  drift_.begin(filter_);
  mapped_velocity_variance_ = velocity_variance(filter_.covariance);
  unaided_.reset();
  begin_new_map("the filter was no longer sound, a new session was begun");
}

/// Whatever the old map was, this is another place or the pose was wrong: a new session begins here. Attitude to
/// gravity, biases and velocity carry over with what is known of them.
void Lio::begin_new_map(const char* reason) {
  map_.clear();
  contradictions_ = 0;
  last_correction_ = filter_.nominal.utime;
  ++session_;
  session_end_.reset();
  keyframer_ = Keyframer(config_, session_);
  trust_.note_loss(reason);
  opinion_.forget();
}

}  // namespace ignis
