// SPDX-License-Identifier: Apache-2.0
//
// The whole driver core under a coverage-guided fuzzer, from the L1's bytes to samples and scans. The first byte of an
// input chooses how the rest is used. Whatever comes in, what goes out must be finite, within the sensor's range,
// strictly ordered in time, and counted.

#include <cmath>
#include <limits>

#include "drivers/l1_decoder.h"
#include "l1_input.h"

namespace {

using namespace ignis;
using fuzz::require;

DriverConfig config_with(const char* time_source) {
  DriverConfig config;
  config.time_source = time_source;
  return config;
}

class Judge {
 public:
  Judge(const DriverConfig& config, const Extrinsics& extrinsics) : config_(config) {
    const double arm = std::max(extrinsics.lidar.T_body_sensor().translation.norm(),
                                extrinsics.imu.T_body_sensor().translation.norm());
    farthest_ = config.range_max_m + 1.0 + arm;
    strongest_ = (config.accel_limit_m_s2 * 1.01 + arm * 3.1 * config.gyro_limit_rad_s * config.gyro_limit_rad_s) * 2.0;
  }

  void look_at(const l1::Event& event) {
    std::visit([this](const auto& each) { check(each); }, event);
  }

 private:
  void check(const ImuSample& sample) {
    require(sample.gyro.allFinite() && sample.gyro.norm() < 2.0 * config_.gyro_limit_rad_s);
    require(sample.accel.allFinite() && sample.accel.norm() < strongest_);
    require(sample.utime > newest_sample_);
    newest_sample_ = sample.utime;
  }

  void check(const Scan& scan) {
    require(scan.utime >= newest_scan_ && scan.duration_us >= 0 && scan.missing_packets >= 0);
    newest_scan_ = scan.utime;
    require(scan.points.size() <= static_cast<std::size_t>(config_.packets_per_scan) * l1::kPointsPerPacket);
    for (const ScanPoint& point : scan.points) {
      require(point.position.allFinite() && point.position.norm() < farthest_);
      require(point.dt_us >= 0 && point.dt_us <= scan.duration_us);
    }
  }

  const DriverConfig& config_;
  double farthest_;
  double strongest_;
  Utime newest_sample_ = std::numeric_limits<Utime>::min();
  Utime newest_scan_ = std::numeric_limits<Utime>::min();
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(std::as_bytes(std::span(data, size)));
  const std::uint8_t mode = input.byte();
  static const Extrinsics extrinsics = l1_extrinsics();
  static const DriverConfig by_arrival = config_with("arrival");
  static const DriverConfig by_counters = config_with("counters");
  // Checking a configuration takes longer than decoding an input, so each run starts from a copy.
  static const l1::L1Decoder fresh_by_arrival(by_arrival, extrinsics);
  static const l1::L1Decoder fresh_by_counters(by_counters, extrinsics);
  const bool counters_only = (mode & 1U) != 0;
  l1::L1Decoder decoder = counters_only ? fresh_by_counters : fresh_by_arrival;
  Judge judge(counters_only ? by_counters : by_arrival, extrinsics);
  Utime arrival = 1'000'000'000;
  while (!input.empty()) {
    const auto bytes = fuzz::next_read(input, (mode & 2U) != 0);
    arrival += (mode & 4U) != 0 ? 4'000 * input.byte() : 2'000;
    for (const l1::Event& event : decoder.feed(bytes, arrival)) judge.look_at(event);
  }
  for (const l1::Event& event : decoder.finish()) judge.look_at(event);
  (void)decoder.take_outgoing();
  const l1::DecoderCounters counters = decoder.counters();
  require(counters.framing.skipped_bytes <= counters.framing.bytes);
  require(counters.pairing.paired >= 0 && counters.scan_gaps >= 0 && counters.imu_gaps >= 0);
  return 0;
}
