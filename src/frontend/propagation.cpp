// SPDX-License-Identifier: Apache-2.0
//
// How Lio carries its states through time: the committed one from scan to scan, the live one to the newest inertial
// sample, and both across samples that are clipped or missing.
#include <algorithm>

#include "frontend/filter/error_step.h"
#include "frontend/filter/standstill.h"
#include "frontend/filter/steady_motion.h"
#include "frontend/lio.h"

namespace ignis {
namespace {

constexpr std::int64_t kHistoryUs = 3 * kMicrosPerSecond;  // IMU kept to deskew with and to dead reckon from
constexpr std::int64_t kCoastingStepUs = 10'000;           // between samples that stand in for a silent IMU
constexpr std::int64_t kClipMemoryUs = kMicrosPerSecond;   // after a clipped sample the biases learn nothing
constexpr Utime kCommitStepUs = kStandstillWindowUs / 2;   // of the committed state while no scan leads it
constexpr double kSaturatedNoiseScale = 1e4;               // a clipped axis may be off by any amount

/// Calls `step(next, input, dt)` for each piece of the line through the samples from `now` to `until`; `now` follows.
/// `next` is the sample that the piece leads to.
void for_each_step(const std::vector<ImuSample>& samples, Utime& now, Utime until, auto&& step) {
  auto next = static_cast<std::size_t>(std::ranges::upper_bound(samples, now, {}, &ImuSample::utime) - samples.begin());
  for (; now < until && next < samples.size(); ++next) {
    const Utime step_end = std::min(until, samples[next].utime);
    const ImuSample first = interpolate(samples[next - 1], samples[next], now);
    const ImuSample last = interpolate(samples[next - 1], samples[next], step_end);
    step(next, midpoint(first, last), seconds_between(now, step_end));
    now = step_end;
  }
}

}  // namespace

void Lio::advance_to(Utime utime) {
  for_each_step(imu_.samples(), filter_.nominal.utime, utime,
                [this](std::size_t next, const InertialInput& input, double dt) {
                  const ImuSample& before = imu_.samples()[next - 1];
                  if (before.utime == filter_.nominal.utime) keyframer_.add_imu(before);
                  if (imu_.gap_before(next)) keyframer_.note_gap();
                  if (unaided_) predict(*unaided_, input, dt, config_, noise_scale(next));
                  const ErrorStep step(filter_.nominal, input, dt, config_, noise_scale(next));
                  step.carry(cautious_);
                  step.carry(filter_.covariance);
                  filter_.nominal = predict_nominal(filter_.nominal, input, dt, config_.gravity_m);
                });
  if (unaided_) unaided_->nominal.utime = filter_.nominal.utime;
}

/// A LiDAR may begin seconds after the IMU: until it does, nothing but standing keeps the origin where it is.
void Lio::follow_to(Utime utime) {
  while (awaits_scans_ && utime - filter_.nominal.utime >= kCommitStepUs) {
    advance_to(filter_.nominal.utime + kCommitStepUs);
    if (use_standstill()) rebuild_live_state();
  }
  advance_to(utime);
}

/// To an instant before which no scan is waited for any more.
void Lio::commit_to(Utime utime) {
  if (utime - filter_.nominal.utime < kCommitStepUs) return;
  follow_to(utime);
  if (is_sound()) sound_ = filter_;
}

/// The state at an instant without anything but the IMU since then.
FilterState Lio::dead_reckoned(FilterState from, Utime until) const {
  for_each_step(imu_.samples(), from.nominal.utime, until,
                [&](std::size_t next, const InertialInput& input, double dt) {
                  predict(from, input, dt, config_, noise_scale(next));
                });
  return from;
}

double Lio::noise_scale(std::size_t sample_after) const {
  const bool clipped = imu_.samples()[sample_after].saturated || imu_.samples()[sample_after - 1].saturated;
  // Across a gap two samples stand for many: the variance of their mean does not shrink with the time between them.
  const double gap = imu_.gap_before(sample_after) ? imu_.periods_before(sample_after) : 1.0;
  return gap * (clipped ? kSaturatedNoiseScale : 1.0);
}

void Lio::rebuild_live_state() {
  const std::vector<ImuSample>& samples = imu_.samples();
  live_ = filter_.nominal;
  auto next =
      static_cast<std::size_t>(std::ranges::upper_bound(samples, live_.utime, {}, &ImuSample::utime) - samples.begin());
  for (; next < samples.size(); ++next) {
    const ImuSample first = interpolate(samples[next - 1], samples[next], live_.utime);
    live_ = predict_nominal(live_, midpoint(first, samples[next]), seconds_between(live_.utime, samples[next].utime),
                            config_.gravity_m);
    live_.utime = samples[next].utime;
  }
}

/// Samples that keep velocity and turn rate, up to an instant that the IMU has not reached. The biases learn nothing
/// from them.
void Lio::coast_to(Utime utime) {
  if (!running_ || imu_.empty()) return;
  while (imu_.newest() < utime) {
    ImuSample sample;
    sample.utime = imu_.newest() + kCoastingStepUs;
    const InertialInput steady = steady_input(live_, config_.gravity_m);
    sample.gyro = steady.gyro;
    sample.accel = steady.accel;
    imu_.add_coasting(sample);
    last_clipped_ = sample.utime;
    live_ = predict_nominal(live_, steady, 1e-6 * kCoastingStepUs, config_.gravity_m);
    live_.utime = sample.utime;
  }
}

/// Before the start nothing has to be deskewed or dead reckoned from further back either.
void Lio::forget_old_samples() {
  if (imu_.empty()) return;
  imu_.forget_before((running_ ? filter_.nominal.utime : imu_.newest()) - kHistoryUs);
}

/// True while the filter's own samples, clipped or coasting, would teach the biases what is not so.
bool Lio::learns_nothing() const { return last_clipped_ && filter_.nominal.utime - *last_clipped_ < kClipMemoryUs; }

/// Undoes what a scan did to the biases and to gravity. Their correlations with the rest are given up, which only
/// widens the rest.
void Lio::keep_biases(const FilterState& predicted) {
  filter_.nominal.gyro_bias = predicted.nominal.gyro_bias;
  filter_.nominal.accel_bias = predicted.nominal.accel_bias;
  filter_.nominal.angular_rate = predicted.nominal.angular_rate;
  filter_.nominal.gravity_tilt = predicted.nominal.gravity_tilt;
  constexpr int kKept = kErrorSize - kGyroBias;
  filter_.covariance.rightCols<kKept>().setZero();
  filter_.covariance.bottomRows<kKept>().setZero();
  filter_.covariance.bottomRightCorner<kKept, kKept>() = predicted.covariance.bottomRightCorner<kKept, kKept>();
}

}  // namespace ignis
