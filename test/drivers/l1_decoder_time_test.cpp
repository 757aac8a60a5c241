// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "drivers/l1_decoder.h"
#include "drivers/l1_samples.h"

/// Stamps against a sensor whose true times are known. The sensor model is this file's own: a queue in front of a 2
/// Mbaud line, inertial samples every 4 ms, packets every 1/180 s, in either policy for samples between AUX and
/// DISTANCE.
namespace ignis::l1 {
namespace {

using samples::append;
using samples::Bytes;

constexpr double kTargetUs = 1000.0;  // accuracy asked of the driver

struct WireFrame {
  double begin_us;
  Bytes bytes;
};

struct Sensor {
  double imu_rate = 1.0;      ///< true period of the inertial unit over nominal
  double imu_phase_us = 0.0;  ///< instant of inertial sample 0
  double imu_latency_us = 300.0;
  double scan_latency_us = 3078.0;
  bool imu_between_pair = false;
  int imu_modulus = 65536;

  [[nodiscard]] double imu_time(std::int64_t i) const {
    return imu_phase_us + static_cast<double>(i) * kImuPeriodUs * imu_rate;
  }

  /// The first `seconds` of the stream, as a real line would carry it.
  [[nodiscard]] std::vector<WireFrame> run(double seconds) const {
    struct Job {
      double ready_us;
      std::vector<Bytes> frames;
    };
    std::vector<Job> jobs;
    for (int k = 0; k < seconds * 180; ++k) {
      const auto id = static_cast<std::uint16_t>(k);
      const double ready = k * kScanPeriodUs + scan_latency_us;
      const Bytes auxiliary = samples::frame(kAuxiliaryId, samples::auxiliary(id));
      const Bytes distance = samples::frame(kDistanceId, samples::distance(id));
      if (imu_between_pair) {
        jobs.push_back({ready, {auxiliary}});
        jobs.push_back({ready + 1105.0, {distance}});
      } else {
        jobs.push_back({ready, {auxiliary, distance}});
      }
    }
    for (int i = 0; i < seconds * 250; ++i) {
      const auto id = static_cast<std::uint16_t>(i % imu_modulus);
      jobs.push_back({imu_time(i) + imu_latency_us, {samples::frame(kImuId, samples::imu(id))}});
    }
    std::ranges::stable_sort(jobs, {}, &Job::ready_us);
    std::vector<WireFrame> wire;
    double free_us = -1e18;
    for (const Job& job : jobs) {
      for (const Bytes& frame : job.frames) {
        const double begin = std::max(job.ready_us, free_us);
        free_us = begin + kByteTimeUs * static_cast<double>(frame.size());
        wire.push_back({begin, frame});
      }
    }
    return wire;
  }
};

struct Worst {
  double imu_us = 0.0;
  double scan_us = 0.0;
  std::size_t imu_samples = 0;
  std::size_t scans = 0;
};

/// Worst stamp error after `settled_us`, and strict order of the stamps. `shift_us`: sensor time 0 on the stamps'
/// clock.
class Judge {
 public:
  Judge(const Sensor& sensor, double shift_us, double settled_us)
      : sensor_(sensor), shift_us_(shift_us), settled_us_(settled_us) {}

  void see(const std::vector<Event>& events) {
    for (const Event& event : events) std::visit([&](const auto& each) { see(each); }, event);
  }
  [[nodiscard]] const Worst& worst() const { return worst_; }

 private:
  void see(const ImuSample& sample) {
    EXPECT_GT(sample.utime, last_imu_);
    last_imu_ = sample.utime;
    const double truth = shift_us_ + sensor_.imu_time(sample.sequence);
    if (truth - shift_us_ >= settled_us_)
      worst_.imu_us = std::max(worst_.imu_us, std::abs(truth - static_cast<double>(sample.utime)));
    ++worst_.imu_samples;
  }
  void see(const Scan& scan) {
    EXPECT_GT(scan.utime, last_scan_);
    last_scan_ = scan.utime;
    const double truth = shift_us_ + scan.sequence * 9 * kScanPeriodUs;
    if (truth - shift_us_ >= settled_us_)
      worst_.scan_us = std::max(worst_.scan_us, std::abs(truth - static_cast<double>(scan.utime)));
    ++worst_.scans;
  }

  const Sensor& sensor_;
  double shift_us_;
  double settled_us_;
  Utime last_imu_ = INT64_MIN;
  Utime last_scan_ = INT64_MIN;
  Worst worst_;
};

Worst decode_capture(const Sensor& sensor, double seconds) {
  DriverConfig config;
  config.time_source = "counters";
  L1Decoder decoder(config, l1_extrinsics());
  Judge judge(sensor, 0.0, 0.0);
  for (const WireFrame& frame : sensor.run(seconds)) judge.see(decoder.feed(frame.bytes, 0));
  judge.see(decoder.finish());
  ::testing::Test::RecordProperty("imu_us", static_cast<int>(judge.worst().imu_us));
  ::testing::Test::RecordProperty("scan_us", static_cast<int>(judge.worst().scan_us));
  return judge.worst();
}

/// Live: bytes reach the host in reads, each late by a random delay, sometimes by a stall.
Worst decode_live(const Sensor& sensor, double seconds, double settled_us, double host_per_sensor_time = 1.0) {
  constexpr double kHostStart = 1.79e15;
  L1Decoder decoder(DriverConfig{}, l1_extrinsics());
  Judge judge(sensor, kHostStart, settled_us);
  std::mt19937 random(11);
  std::exponential_distribution<double> delay(1.0 / 400.0);
  double host_us = 0.0;
  Bytes pending;
  for (const WireFrame& frame : sensor.run(seconds)) {
    append(pending, frame.bytes);
    const double end = (frame.begin_us + kByteTimeUs * static_cast<double>(frame.bytes.size())) * host_per_sensor_time;
    if (host_us > end) continue;  // the host is still asleep; the kernel keeps the bytes
    host_us = end + delay(random) + (random() % 400 == 0 ? 60'000.0 : 0.0);
    judge.see(decoder.feed(pending, static_cast<Utime>(kHostStart + host_us)));
    pending.clear();
  }
  ::testing::Test::RecordProperty("imu_us", static_cast<int>(judge.worst().imu_us));
  ::testing::Test::RecordProperty("scan_us", static_cast<int>(judge.worst().scan_us));
  return judge.worst();
}

TEST(L1DecoderTime, CapturesMeetTheTargetFromTheFirstSample) {
  for (const bool between : {false, true}) {
    for (const double phase : {0.0, 700.0, 2345.0}) {
      const Worst worst = decode_capture({.imu_phase_us = phase, .imu_between_pair = between}, 5.0);
      EXPECT_EQ(worst.imu_samples, 1250U);
      EXPECT_EQ(worst.scans, 100U);
      EXPECT_LE(worst.scan_us, 1.0);
      EXPECT_LT(worst.imu_us, kTargetUs / 2) << "phase " << phase << " between " << between;
    }
  }
}

TEST(L1DecoderTime, CapturesFollowAnInertialClockOfAnotherRate) {
  for (const double rate : {0.999, 1.00104}) {  // 250.25 and the 249.74 Hz of a real recording
    EXPECT_LT(decode_capture({.imu_rate = rate}, 30.0).imu_us, kTargetUs);
  }
}

TEST(L1DecoderTime, CapturesSurviveAnEarlyWrapOfTheInertialCounter) {
  const Worst worst = decode_capture({.imu_modulus = 1024}, 10.0);
  EXPECT_EQ(worst.imu_samples, 2500U);
  EXPECT_LT(worst.imu_us, kTargetUs / 2);
}

TEST(L1DecoderTime, LiveStampsMeetTheTargetBehindJitterAndStalls) {
  const Worst worst = decode_live({}, 30.0, 1e6);
  EXPECT_EQ(worst.imu_samples, 7500U);
  EXPECT_LT(worst.imu_us, kTargetUs);
  EXPECT_LT(worst.scan_us, kTargetUs);
}

TEST(L1DecoderTime, LiveStampsFollowASensorOfAnotherRate) {
  const Worst worst = decode_live({.imu_rate = 1.00104}, 30.0, 2e6);
  EXPECT_LT(worst.imu_us, kTargetUs);
  EXPECT_LT(worst.scan_us, kTargetUs);
}

TEST(L1DecoderTime, LiveFiguresNameTheDriftOfTheClocks) {
  DriverConfig config;
  L1Decoder decoder(config, l1_extrinsics());
  for (const WireFrame& frame : Sensor{}.run(12.0)) {
    const double end = frame.begin_us + kByteTimeUs * static_cast<double>(frame.bytes.size());
    (void)decoder.feed(frame.bytes, std::llround(1e12 + end * 1.0002));
  }
  EXPECT_NEAR(decoder.clock().drift_ppm(), -200.0, 5.0);
  EXPECT_LT(decoder.clock().jitter_us(), 300.0);
}

TEST(L1DecoderTime, StampsGoOnForwardsWhenTheSensorRestarts) {
  const Sensor sensor;
  L1Decoder decoder(DriverConfig{}, l1_extrinsics());
  Utime last = 0;
  Utime newest_before = 0;
  for (const double offset : {0.0, 10e6}) {  // off for 7 s, then counters from 0 again
    for (const WireFrame& frame : sensor.run(3.0)) {
      for (const Event& event : decoder.feed(frame.bytes, std::llround(1e12 + offset + frame.begin_us + 500.0))) {
        if (const auto* sample = std::get_if<ImuSample>(&event)) {
          EXPECT_GT(sample->utime, last);
          last = sample->utime;
        }
      }
    }
    if (offset == 0.0) newest_before = last;
  }
  EXPECT_NEAR(static_cast<double>(last - newest_before), 10e6, 2000.0);
}

TEST(L1DecoderTime, StampsFollowTheNewPhaseWhenTheSensorRestarts) {
  // The new counters lie 1.5 ms late on the old line, which remembers its earliest arrivals for ten seconds.
  constexpr double kFirstRunS = 9.0;
  constexpr double kSecondRunS = 2.0;
  constexpr double kSettledUs = 500'000.0;
  constexpr double kRestartUs = kFirstRunS * 1e6 + 1e6 + 1500.0;
  const Sensor sensor;
  L1Decoder decoder(DriverConfig{}, l1_extrinsics());
  std::int64_t samples = 0;
  double worst = 0.0;
  for (const double offset : {0.0, kRestartUs}) {
    samples = 0;
    for (const WireFrame& frame : sensor.run(offset == 0.0 ? kFirstRunS : kSecondRunS)) {
      for (const Event& event : decoder.feed(frame.bytes, std::llround(1e12 + offset + frame.begin_us + 500.0))) {
        const auto* sample = std::get_if<ImuSample>(&event);
        if (sample == nullptr) continue;
        const double truth = sensor.imu_time(samples++);
        if (offset == 0.0 || truth < kSettledUs) continue;
        worst = std::max(worst, std::abs(static_cast<double>(sample->utime) - 1e12 - offset - truth));
      }
    }
  }
  EXPECT_EQ(samples, 500);
  EXPECT_LT(worst, kTargetUs);
  EXPECT_GE(decoder.counters().restarts, 1);
}

}  // namespace
}  // namespace ignis::l1
