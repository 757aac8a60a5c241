// SPDX-License-Identifier: Apache-2.0
//
// Framing, decoding, checks, pairing and counting of the L1's bytes under a coverage-guided fuzzer: what stands between
// the wire and everything else, without the geometry, so that ten times as many inputs are tried.

#include <cmath>

#include "drivers/packet_stream.h"
#include "l1_input.h"

namespace {

using namespace ignis;
using fuzz::require;

/// Checks that counts never go down and that content passed the value checks.
class Judge {
 public:
  void look_at(const l1::Packet& packet) {
    std::visit([this](const auto& each) { check(each); }, packet);
  }

 private:
  void check(const l1::CountedPacket& packet) {
    require(packet.pair.auxiliary.packet_id == packet.pair.distance.packet_id);
    require(std::isfinite(packet.pair.auxiliary.yaw_start_deg) && std::isfinite(packet.pair.auxiliary.ksi_rad));
    require(packet.count > newest_packet_);
    newest_packet_ = packet.count;
  }
  void check(const l1::CountedImu& imu) {
    for (const float value : imu.attitude.accel) require(std::isfinite(value));
    for (const float value : imu.attitude.gyro) require(std::isfinite(value));
    require(imu.count > newest_sample_);
    newest_sample_ = imu.count;
  }
  void check(const auto&) {}

  std::int64_t newest_packet_ = -1;
  std::int64_t newest_sample_ = -1;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(std::as_bytes(std::span(data, size)));
  const std::uint8_t mode = input.byte();
  DriverConfig config;
  config.time_source = (mode & 1U) != 0 ? "counters" : "arrival";
  l1::PacketStream stream(config);
  Judge judge;
  Utime arrival = 1'000'000'000;
  while (!input.empty()) {
    const auto bytes = fuzz::next_read(input, (mode & 2U) != 0);
    arrival += (mode & 4U) != 0 ? 4'000 * input.byte() : 2'000;
    for (const l1::Packet& packet : stream.feed(bytes, arrival)) judge.look_at(packet);
  }
  for (const l1::Packet& packet : stream.finish()) judge.look_at(packet);
  const l1::StreamCounters counters = stream.counters();
  require(counters.framing.skipped_bytes <= counters.framing.bytes);
  require(counters.pairing.paired >= 0 && counters.scan_gaps >= 0 && counters.imu_gaps >= 0);
  return 0;
}
