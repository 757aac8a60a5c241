// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <ostream>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/l1_decoder.h"
#include "drivers/l1_samples.h"

/// A sensor whose counters and clock leap while the line goes on, or falls silent for a while and goes on.
namespace ignis::l1 {
namespace {

using samples::append;
using samples::Bytes;

constexpr double kHostStartUs = 1.79e15;
constexpr double kLeapAtUs = 3e6;
constexpr double kAfterUs = 3e6;
constexpr double kUnannouncedUs = 100'000.0;
constexpr double kAnnouncedWithinUs = 1e6;
constexpr double kScanUs = 9 * kScanPeriodUs;

/// What happens at kLeapAtUs.
struct Leap {
  double samples_us = 0.0;  ///< that the counter of the inertial samples leaps by
  double packets_us = 0.0;
  double time_us = 0.0;     ///< of the clock that AUX carries
  double silence_us = 0.0;  ///< of the line before it; all counters go on in it
};

std::ostream& operator<<(std::ostream& out, const Leap& leap) {
  return out << "samples " << leap.samples_us << ", packets " << leap.packets_us << ", time " << leap.time_us
             << " after a silence of " << leap.silence_us << " us";
}

std::uint16_t id_of(std::int64_t count, double leap_us, double period_us) {
  return static_cast<std::uint16_t>((count + std::llround(leap_us / period_us)) & 0xFFFF);
}

Bytes sample_frame(std::int64_t count, double leap_us) {
  return samples::frame(kImuId, samples::imu(id_of(count, leap_us, kImuPeriodUs)));
}

Bytes packet_frames(std::int64_t count, double leap_us, double time_leap_us) {
  const std::uint16_t id = id_of(count, leap_us, kScanPeriodUs);
  Auxiliary auxiliary = samples::auxiliary(id);
  const double time_us = 4e9 + static_cast<double>(count) * kScanPeriodUs + time_leap_us;  // it runs for an hour
  auxiliary.time_s = static_cast<std::uint32_t>(time_us / 1e6);
  auxiliary.time_us = static_cast<std::uint32_t>(std::fmod(time_us, 1e6));
  Bytes bytes = samples::frame(kAuxiliaryId, auxiliary);
  append(bytes, samples::frame(kDistanceId, samples::distance(id)));
  return bytes;
}

/// Stamps of one stream that step further than the time that has passed.
class Leaps {
 public:
  struct Unexplained {
    double at_us;
    double by_us;
    std::int64_t epoch_before;
  };

  void see(double stamp_us, double arrival_us, std::int64_t epoch) {
    if (last_) {
      EXPECT_GT(stamp_us, last_->stamp_us);
      const double by_us = (stamp_us - last_->stamp_us) - (arrival_us - last_->arrival_us);
      if (by_us > kUnannouncedUs) found_.push_back({arrival_us, by_us, last_->epoch});
    }
    last_ = {stamp_us, arrival_us, epoch};
  }

  [[nodiscard]] const std::vector<Unexplained>& found() const { return found_; }

 private:
  struct Last {
    double stamp_us;
    double arrival_us;
    std::int64_t epoch;
  };
  std::optional<Last> last_;
  std::vector<Unexplained> found_;
};

/// What a driver makes of a sensor that leaps.
class Drive {
 public:
  Drive(const Leap& leap, unsigned seed) : leap_(leap), random_(seed) {
    std::int64_t samples = 0;
    std::int64_t packets = 0;
    const double end_us = kLeapAtUs + leap.silence_us + kAfterUs;
    for (double now_us = 0.0; now_us < end_us;) {
      const double sample_us = static_cast<double>(samples) * kImuPeriodUs;
      const double packet_us = static_cast<double>(packets) * kScanPeriodUs;
      now_us = std::min(sample_us, packet_us);
      const bool leapt = now_us >= kLeapAtUs;
      const Leap by = leapt ? leap : Leap{};
      const bool is_sample = sample_us <= packet_us;
      const Bytes bytes =
          is_sample ? sample_frame(samples++, by.samples_us) : packet_frames(packets++, by.packets_us, by.time_us);
      if (leapt && now_us < kLeapAtUs + leap.silence_us) continue;
      feed(bytes, now_us);
    }
  }

  /// Leaps of either stream, each announced within a second by another epoch.
  [[nodiscard]] std::size_t announced_leaps() const {
    std::size_t number = 0;
    for (const Leaps* stream : {&samples_, &scans_}) {
      for (const Leaps::Unexplained& each : stream->found()) {
        EXPECT_NE(epoch_at(each.at_us + kAnnouncedWithinUs), each.epoch_before)
            << leap_ << ": unannounced leap by " << each.by_us << " us at " << each.at_us << " us";
        ++number;
      }
    }
    return number;
  }

  [[nodiscard]] std::int64_t epochs() const { return epochs_.empty() ? 0 : epochs_.back().epoch; }
  [[nodiscard]] double late_at_end_us() const { return late_at_end_us_; }

 private:
  struct Epoch {
    double at_us;
    std::int64_t epoch;
  };

  void feed(const Bytes& bytes, double now_us) {
    const double arrival_us = now_us + 500.0 + delay_(random_);
    for (const Event& event : decoder_.feed(bytes, std::llround(kHostStartUs + arrival_us))) {
      const std::int64_t epoch = decoder_.counters().clock_restarts;
      if (epoch != epochs()) epochs_.push_back({arrival_us, epoch});
      if (const auto* sample = std::get_if<ImuSample>(&event)) {
        late_at_end_us_ = kHostStartUs + arrival_us - static_cast<double>(sample->utime);
        samples_.see(static_cast<double>(sample->utime), arrival_us, epoch);
      } else {
        const Scan& scan = std::get<Scan>(event);
        EXPECT_LT(scan.duration_us, kScanUs + kUnannouncedUs) << leap_ << ": a scan is stretched over the leap";
        scans_.see(static_cast<double>(scan.end_utime()), arrival_us, epoch);
      }
    }
  }

  [[nodiscard]] std::int64_t epoch_at(double when_us) const {
    std::int64_t newest = 0;
    for (const Epoch& each : epochs_) {
      if (each.at_us <= when_us) newest = each.epoch;
    }
    return newest;
  }

  Leap leap_;
  std::mt19937 random_;
  std::exponential_distribution<double> delay_{1.0 / 300.0};
  L1Decoder decoder_{DriverConfig{}, l1_extrinsics()};
  Leaps samples_;
  Leaps scans_;
  std::vector<Epoch> epochs_;
  double late_at_end_us_ = 0.0;
};

constexpr double kHourUs = 3.6e9;

TEST(Fault_D5, StampsThatLeapComeWithAnotherEpoch) {
  std::mt19937 random(41);
  std::uniform_real_distribution<double> any_us(-2e6, 2e6);
  const auto one_of = [&](std::initializer_list<double> choices) {
    return *(choices.begin() + static_cast<std::ptrdiff_t>(random() % choices.size()));
  };
  std::size_t leaps = 0;
  for (int i = 0; i < 90; ++i) {
    const double leap_us = one_of({1e6, -1e6, kHourUs, -kHourUs, any_us(random), any_us(random)});
    const Leap leap{.samples_us = one_of({0.0, leap_us, leap_us, any_us(random)}),
                    .packets_us = one_of({0.0, leap_us, leap_us, any_us(random)}),
                    .time_us = one_of({0.0, leap_us}),
                    .silence_us = one_of({0.0, 0.0, 50'000.0, 400'000.0, 2.5e6})};
    leaps += Drive(leap, static_cast<unsigned>(random())).announced_leaps();
  }
  EXPECT_GT(leaps, 20U) << "the test must see some";
}

TEST(Fault_D5, ASilenceOfTheLineIsAGapAndNoNewEpoch) {
  for (const double silence_us : {50'000.0, 300'000.0, 1e6, 10e6}) {
    const Drive drive({.silence_us = silence_us}, 42);
    EXPECT_EQ(drive.announced_leaps(), 0U) << silence_us;
    EXPECT_EQ(drive.epochs(), 0) << silence_us;
    EXPECT_LT(drive.late_at_end_us(), 5'000.0) << silence_us;
  }
}

}  // namespace
}  // namespace ignis::l1
