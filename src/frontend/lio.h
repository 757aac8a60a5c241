// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/keyframe.h"
#include "common/measurements.h"
#include "frontend/filter/imu_buffer.h"
#include "frontend/frontend_config.h"
#include "frontend/keyframes/keyframer.h"
#include "frontend/local_map/local_map.h"
#include "frontend/local_map/voxel_thinner.h"
#include "frontend/matching/deskew.h"
#include "frontend/matching/scan_matcher.h"
#include "frontend/matching/scan_selection.h"
#include "frontend/recovery/reacquisition.h"
#include "frontend/scan_stats.h"
#include "frontend/start/imu_initialisation.h"
#include "frontend/start/start_motion.h"
#include "frontend/trust/map_drift.h"
#include "frontend/trust/second_opinion.h"
#include "frontend/trust/sighted_walls.h"
#include "frontend/trust/trust_monitor.h"

namespace ignis {

/// Everything that one scan led to.
struct ScanResult {
  ScanStats stats;
  bool has_state = false;  ///< false before the start; then only `stats` means anything
  NavState state;          ///< at the scan's end, frame odom
  Matrix15d covariance = Matrix15d::Identity();
  Trust trust = Trust::kDegraded;  ///< in that state
  std::vector<CloudPoint> cloud;   ///< deskewed, in range, body frame at the scan's end
  std::optional<Keyframe> keyframe;
};

/// What one IMU sample led to.
struct ImuResult {
  ImuFault fault = ImuFault::kNone;  ///< why the sample was not taken
  std::optional<NavState> state;     ///< newest state, at this sample; empty before the start or after a fault
  std::vector<ScanResult> scans;     ///< scans that this sample completed, oldest first
};

struct LioStatus {
  bool running = false;
  std::string text;  ///< what is being waited for, what was refused, or how it started
  Trust trust = Trust::kDegraded;
  std::string reason;  ///< of the trust
};

/// LiDAR-inertial odometry: an error-state Kalman filter driven by the IMU and corrected by scans against a local map.
///
/// Two states are kept. The committed one ends at the last scan and carries the covariance. The live one runs ahead of
/// it to the newest IMU sample and is rebuilt whenever a scan arrives. A scan is processed as soon as both it and the
/// IMU data up to its end are there, so scan results do not depend on how the two streams interleave, as long as a scan
/// is at most `max_scan_delay_s` late. Not for concurrent use. Holds no clock: time is what the stamps say.
class Lio {
 public:
  /// Waits for the start of a session. `note` is why it does not go on with an earlier one, for people.
  explicit Lio(const FrontendConfig& config, std::int32_t session = 0, std::string note = {});

  [[nodiscard]] ImuResult add_imu(const ImuSample& sample);
  [[nodiscard]] std::vector<ScanResult> add_scan(Scan scan);

  /// What is told of a scan that is not used, or, with kBehind, that the caller leaves out.
  [[nodiscard]] ScanResult refuse(const Scan& scan, ScanReason reason) const;

  /// Forgets everything and starts a new session.
  void reset();

  /// The same, by a command: `session` ends with the first sample behind `utime`, 0.15 to 2 s ahead of the newest one;
  /// the next session begins with the sample after that. Scans that end in the 0.15 s up to `utime`, and older ones
  /// that come when it has passed, are refused, so that it does not matter which of them come late. A second command
  /// while one is pending changes nothing. Why it cannot be; empty when it will.
  [[nodiscard]] const char* begin_anew_after(Utime utime, std::int32_t session);

  /// After its state has been read back from bytes (see checkpoint.h): speed and turn rate go on over the time since
  /// then, and scans are searched for widely. Until ten of them have fitted as scans did before, none enters the map,
  /// no keyframe is made, and three in a row that contradict take back what the others said. A new session begins when
  /// the gap is too long or the confirmation does not come.
  void resume();

  /// Whether a successor could go on from this state: started, and confirmed if it was resumed itself.
  [[nodiscard]] bool can_be_resumed() const;

  /// What became of an earlier session at this start; empty when there was none.
  [[nodiscard]] const std::string& start_note() const { return start_note_; }

  /// All numbers are finite, and the covariance is one.
  [[nodiscard]] bool is_sound() const;

  [[nodiscard]] LioStatus status() const;
  [[nodiscard]] const ImuCounters& imu_counters() const { return imu_.counters(); }
  [[nodiscard]] std::int32_t session() const { return session_; }
  [[nodiscard]] const LocalMap& map() const { return map_; }

 private:
  [[nodiscard]] std::vector<ScanResult> process_pending();
  [[nodiscard]] ScanResult process(const Scan& scan);
  [[nodiscard]] ScanResult result_of(const Scan& scan, const MatchResult& match, std::vector<CloudPoint> cloud,
                                     std::vector<CloudPoint> sparse);
  [[nodiscard]] KeyframePace keyframe_pace() const;
  void forget_old_samples();
  [[nodiscard]] bool comes_too_soon(const Scan& scan) const;
  [[nodiscard]] MatchResult correct(const std::vector<CloudPoint>& cloud, const std::vector<CloudPoint>& sparse,
                                    double age);
  [[nodiscard]] Reacquisition place_to_begin() const;
  [[nodiscard]] MapScans salient_scans() const;
  [[nodiscard]] int sure_since(double sigma_m) const;
  /// [m^2] odom axes.
  [[nodiscard]] Eigen::Matrix3d published_position_covariance() const;
  void count_correction(const FilterState& predicted, const MatchResult& match, double age);
  void heed_sighted_walls(const FilterState& predicted, const MatchResult& match);
  void enter_map(const std::vector<CloudPoint>& cloud, const MatchResult& match);
  void grow_map(const std::vector<CloudPoint>& cloud, const MatchResult& match);
  void follow_moving_start(ScanReason reason);
  void heed_second_opinion(const FilterState& predicted, const MatchResult& match);
  [[nodiscard]] FilterState dead_reckoned(FilterState from, Utime until) const;
  void note_evidence(const FilterState& predicted, ScanStats stats, const Scan& scan);
  void begin_new_map(const char* reason);
  void mend_filter();
  void coast_to(Utime utime);
  /// Whether the vehicle stands at the committed instant.
  bool use_standstill();
  [[nodiscard]] std::vector<CloudPoint> register_points(const Scan& scan);
  [[nodiscard]] bool learns_nothing() const;
  void keep_biases(const FilterState& predicted);
  void advance_to(Utime utime);
  void follow_to(Utime utime);
  void commit_to(Utime utime);
  void begin_in_motion(std::string note);
  void begin_behind(double seconds, std::string note);
  [[nodiscard]] bool still_moves(double seconds) const;
  /// Within the last `seconds`, or goes on resting.
  [[nodiscard]] bool has_rested(double seconds) const;
  void await_start(const ImuSample& sample);
  void await_start_in_motion(const ImuSample& sample);
  void start(const FilterState& first, bool at_rest);
  void start_moving(const FilterState& first);
  [[nodiscard]] std::string start_text() const;
  void ask_scans_or_wait();
  void doubt_start();
  [[nodiscard]] bool gathers_first_scans(const Scan& scan);
  void ask_scans_for_motion();
  [[nodiscard]] bool ends_with(Utime sample) const;
  void begin_anew();
  [[nodiscard]] bool falls_to_ended_session(const Scan& scan) const;
  [[nodiscard]] ScanResult verdict_of_ended_session(const Scan& scan) const;
  void give_up_resumption(Utime now, std::vector<ScanResult>& refused);
  [[nodiscard]] bool has_flown_away() const;
  void refuse_pending(std::vector<ScanResult>& refused);
  void close_gap(Utime first_sample);
  void await_confirmation(Utime since);
  [[nodiscard]] bool confirmation_failed(Utime now) const;
  enum class Silence : std::int8_t { kNone, kBridged, kTooLong };  ///< of both streams: what became of it
  [[nodiscard]] Silence bridge_silence(Utime before, Utime sample, std::vector<ScanResult>& refused);
  void seek_confirmation(ScanReason reason);
  void rebuild_live_state();
  [[nodiscard]] double noise_scale(std::size_t sample_after) const;

  /// By a command.
  struct SessionEnd {
    std::int32_t session = 0;
    Utime utime = 0;  ///< the first sample behind it is the last one
  };

  static constexpr double kSecondsUntilReacquisition = 0.27;  ///< without a correction: five scans of an L1

  FrontendConfig config_;
  std::int32_t session_ = 0;
  ImuBuffer imu_;
  ImuInitialisation initialisation_;
  std::optional<ImuInitialisation> initialisation_in_motion_;  ///< beside it, after a loss on the way
  Utime awaited_since_ = 0;                                    ///< a start: first sample of the session
  StartMotion start_motion_;                                   ///< until the start, or while first scans are gathered
  bool awaits_scans_ = false;                                  ///< none had come at the start
  std::optional<Utime> gathering_since_;                       ///< end of the first of them
  std::string start_finding_;                                  ///< what scans said of the motion then
  std::optional<Utime> last_asked_;  ///< instant at which scans did not tell how fast the vehicle goes
  ScanSelector selector_;
  Deskewer deskewer_;
  VoxelThinner thinner_;
  std::vector<Eigen::Vector3f> match_points_;  ///< [m] body frame; of the scan at hand, kept for its memory
  ScanMatcher matcher_;
  LocalMap map_;
  MapDrift drift_;
  Keyframer keyframer_;
  TrustMonitor trust_;
  SecondOpinion opinion_;
  SightedWalls sighted_walls_;
  std::deque<Scan> pending_;
  std::optional<Utime> last_scan_end_;  ///< of the newest scan that was taken into the queue
  bool running_ = false;
  FilterState filter_;  ///< committed
  /// Covariance of the same state when nothing is believed about directions that scans hardly observe. The filter's own
  /// uses what little they say to correct the state; this one is published and judged by.
  ErrorCovariance cautious_ = ErrorCovariance::Identity();
  FilterState sound_;  ///< the committed one when it was last looked at and sound
  NavState live_;
  bool velocity_known_ = false;
  double mapped_velocity_variance_ = 0.0;  ///< [m^2/s^2] with which the points of the map were deskewed, in the mean
  int applied_scans_ = 0;
  int contradictions_ = 0;                ///< in a row
  std::optional<Utime> last_correction_;  ///< none: nobody knows how far the map lies from the points
  bool has_set_off_ = true;               ///< since it was last told to stand
  std::optional<Utime> last_standstill_;  ///< instant of the last correction to zero velocity
  std::optional<Utime> last_clipped_;     ///< instant of the newest sample that says nothing about the biases
  std::optional<Utime> resumed_from_;     ///< newest sample of the predecessor, until the first own one
  std::optional<Utime> gap_end_;          ///< since when a resumption waits for its confirmation
  int scans_since_gap_ = 0;               ///< that it has had for it
  std::optional<FilterState> unaided_;    ///< the same state without a scan since the resumption, until it is confirmed
  std::optional<SessionEnd> session_end_;
  std::string start_note_;

  /// Everything that later results depend on. Scans that wait for their IMU samples are left out: they are lost with
  /// the process, like the data after them.
  friend void transfer(auto& io, FieldsOf<Lio> auto& lio) {
    io.number(lio.session_);
    transfer(io, lio.imu_);
    transfer(io, lio.matcher_);
    transfer(io, lio.map_);
    transfer(io, lio.drift_);
    transfer(io, lio.keyframer_);
    transfer(io, lio.trust_);
    transfer(io, lio.opinion_);
    transfer(io, lio.sighted_walls_);
    io.maybe(lio.last_scan_end_);
    io.number(lio.running_);
    transfer(io, lio.filter_);
    io.matrix(lio.cautious_);
    transfer(io, lio.live_);
    io.number(lio.velocity_known_);
    io.number(lio.mapped_velocity_variance_);
    io.number(lio.applied_scans_);
    io.number(lio.contradictions_);
    io.maybe(lio.last_correction_);
    io.number(lio.has_set_off_);
    io.maybe(lio.last_standstill_);
    io.maybe(lio.last_clipped_);
  }
};

}  // namespace ignis
