// SPDX-License-Identifier: Apache-2.0
//
// How a front end goes on where its killed predecessor was (see Lio::resume): the gap is closed by the first samples,
// and scans have to confirm the pose before anything is built on it.
#include <format>

#include "frontend/lio.h"

namespace ignis {
namespace {

constexpr double kConfirmationSeconds = 2.0;     // that a resumption has
constexpr int kContradictionsOfAWrongPlace = 3;  // in a row; single ones come in any curve

}  // namespace

void Lio::resume() {
  resumed_from_ = imu_.newest();
  unaided_ = filter_;
  scans_without_correction_ = kScansUntilReacquisition;
  trust_.note_resumption();
  start_note_ = std::format("going on with session {}", session_);
}

bool Lio::can_be_resumed() const { return running_ && velocity_known_ && !trust_.awaits_confirmation(); }

bool Lio::is_sound() const {
  ErrorCovariance covariance = filter_.covariance;
  ErrorCovariance cautious = cautious_;
  const NavState& state = filter_.nominal;
  return running_ && !imu_.empty() && make_symmetric(covariance) && make_symmetric(cautious) &&
         state.T_odom_body.all_finite() && state.v_odom.allFinite() && state.gyro_bias.allFinite() &&
         state.accel_bias.allFinite();
}

/// The first sample after a restart decides whether the gap can be bridged.
void Lio::close_gap(Utime first_sample) {
  const double gap = seconds_between(*resumed_from_, first_sample);
  resumed_from_.reset();
  confirm_until_ = first_sample + to_micros(kConfirmationSeconds);
  if (gap > 0.0 && gap <= config_.resume_max_gap_s) return;
  reset();
  start_note_ = std::format("new session: the checkpoint is {:.1f} s older than the data (limit {:.1f})", gap,
                            config_.resume_max_gap_s);
}

/// The first scan after a gap may settle in a wrong place, and then says so with confidence. The next ones tell.
void Lio::seek_confirmation(ScanReason reason) {
  if (!unaided_) return;
  if (!trust_.awaits_confirmation()) {
    unaided_.reset();
    return;
  }
  contradictions_ = is_contradiction(reason) ? contradictions_ + 1 : 0;
  if (contradictions_ < kContradictionsOfAWrongPlace) return;
  contradictions_ = 0;
  filter_ = *unaided_;
  cautious_ = unaided_->covariance;
  scans_without_correction_ = kScansUntilReacquisition;
  trust_.note_resumption();
}

/// Nobody knows where in the old map the vehicle is. Attitude to gravity, biases and velocity carry over.
void Lio::give_up_resumption() {
  filter_ = *unaided_;
  cautious_ = unaided_->covariance;
  unaided_.reset();
  begin_new_map();
  start_note_ = "new session: scans did not confirm the pose of the checkpoint";
}

}  // namespace ignis
