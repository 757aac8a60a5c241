// SPDX-License-Identifier: Apache-2.0
//
// How a front end goes on where its killed predecessor was (see Lio::resume): speed and turn rate go on over the gap,
// and scans have to confirm the pose before anything is built on it. A driver that hung leaves the same gap.
#include <algorithm>
#include <format>

#include "frontend/filter/steady_motion.h"
#include "frontend/lio.h"

namespace ignis {
namespace {

constexpr double kConfirmationSeconds = 2.0;     // that a resumption has at least
constexpr int kScansOfAConfirmation = 20;        // and so many scans, twice what has to be applied
constexpr double kLongestConfirmation = 8.0;     // s: however few come
constexpr int kContradictionsOfAWrongPlace = 3;  // in a row; single ones come in any curve
constexpr double kSilenceSeconds = 0.3;          // of inertial samples and scans, that two samples cannot stand for
constexpr double kLongestSilence = 3.0;          // s: the longest that is bridged

}  // namespace

void Lio::resume() {
  resumed_from_ = imu_.newest();
  unaided_ = filter_;
  sound_ = filter_;
  last_correction_.reset();
  trust_.note_resumption();
  start_note_ = std::format("going on with session {}", session_);
}

/// Neither stream said anything since `before`: not two samples for all that were missed, but scans have to tell where
/// the vehicle is, as after a restart. Over too long a time nothing is left to go on from. Scans that waited for
/// samples which never came are `refused`.
Lio::Silence Lio::bridge_silence(Utime before, Utime sample, std::vector<ScanResult>& refused) {
  const double silence = seconds_between(last_scan_end_ ? std::max(before, *last_scan_end_) : before, sample);
  if (!running_ || !velocity_known_ || map_.empty() || silence < kSilenceSeconds) return Silence::kNone;
  refuse_pending(refused);
  if (silence > kLongestSilence) {
    begin_behind(silence, std::format("new session: neither IMU data nor scans came for {:.1f} s (limit {:.1f})",
                                      silence, kLongestSilence));
    return Silence::kTooLong;
  }
  advance_to(before);
  const double blind = seconds_between(filter_.nominal.utime, sample);
  FilterState cautious{filter_.nominal, cautious_};
  go_on_steadily(cautious, blind);
  cautious_ = cautious.covariance;
  go_on_steadily(filter_, blind);
  filter_.nominal.utime = sample;
  live_ = filter_.nominal;
  keyframer_.note_gap();
  unaided_ = filter_;
  await_confirmation(sample);
  last_correction_.reset();
  trust_.note_resumption();
  return Silence::kBridged;
}

/// Without a map there is nothing that scans could confirm.
bool Lio::can_be_resumed() const {
  return running_ && velocity_known_ && !awaits_scans_ && !trust_.awaits_confirmation();
}

bool Lio::is_sound() const {
  const NavState& state = filter_.nominal;
  return running_ && !imu_.empty() && is_covariance(filter_.covariance) && is_covariance(cautious_) &&
         state.T_odom_body.all_finite() && state.v_odom.allFinite() && state.gyro_bias.allFinite() &&
         state.accel_bias.allFinite() && state.angular_rate.allFinite() && state.gravity_tilt.allFinite();
}

/// The first sample after a restart decides whether the gap can be bridged.
void Lio::close_gap(Utime first_sample) {
  const double gap = seconds_between(*resumed_from_, first_sample);
  resumed_from_.reset();
  await_confirmation(first_sample);
  if (gap > 0.0 && gap <= config_.resume_max_gap_s) return;
  begin_behind(gap, std::format("new session: the checkpoint is {:.1f} s older than the data (limit {:.1f})", gap,
                                config_.resume_max_gap_s));
}

void Lio::await_confirmation(Utime since) {
  gap_end_ = since;
  scans_since_gap_ = 0;
}

/// Of a slow LiDAR, or one whose scans are left out for want of time, two seconds are a handful of scans. If any come,
/// they are given the time that it takes.
bool Lio::confirmation_failed(Utime now) const {
  if (!unaided_) return false;
  const double seconds = seconds_between(*gap_end_, now);
  const bool are_few = scans_since_gap_ > 0 && scans_since_gap_ < kScansOfAConfirmation;
  return seconds > (are_few ? kLongestConfirmation : kConfirmationSeconds);
}

/// The first scan after a gap may settle in a wrong place, and then says so with confidence. The next ones tell.
void Lio::seek_confirmation(ScanReason reason) {
  if (!unaided_) return;
  ++scans_since_gap_;
  if (!trust_.awaits_confirmation()) {
    unaided_.reset();
    return;
  }
  contradictions_ = is_contradiction(reason) ? contradictions_ + 1 : 0;
  if (contradictions_ < kContradictionsOfAWrongPlace) return;
  contradictions_ = 0;
  filter_ = *unaided_;
  cautious_ = unaided_->covariance;
  keyframer_.forget_sighted();
  last_correction_.reset();
  trust_.note_resumption();
}

/// Nobody knows where in the old map the vehicle is, nor, after seconds of dead reckoning across a gap, how fast it
/// goes: a new session that went on with that would fly away. Scans that waited are `refused`.
void Lio::give_up_resumption(Utime now, std::vector<ScanResult>& refused) {
  refuse_pending(refused);
  begin_behind(seconds_between(*gap_end_, now), "new session: scans did not confirm the pose after a gap");
}

}  // namespace ignis
