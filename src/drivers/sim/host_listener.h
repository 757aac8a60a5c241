// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>
#include <variant>
#include <vector>

#include "drivers/frame_parser.h"
#include "drivers/sim/device_config.h"

namespace ignis::sim {

struct VersionQuery {};
/// The host wants a time-sync request now.
struct SyncQuery {};
struct SyncAnswer {
  std::uint32_t count = 0;  ///< of the request that it answers
};
struct ModeCommand {
  l1::WorkingMode mode = l1::WorkingMode::kNormal;  ///< normal or standby
};
struct LedCommand {
  std::uint8_t mode = l1::LedRing::kTableMode;  ///< 1..8
};

/// What a host asked for and the sensor does.
using HostCommand = std::variant<VersionQuery, SyncQuery, SyncAnswer, ModeCommand, LedCommand>;

struct HostCounters {
  std::int64_t version_queries = 0;
  std::int64_t sync_queries = 0;
  std::int64_t sync_answers = 0;
  std::int64_t mode_commands = 0;  ///< obeyed
  std::int64_t led_commands = 0;   ///< obeyed
  std::int64_t ignored = 0;        ///< mode and LED commands that went unheard, as real sensors let them
  std::int64_t unknown = 0;        ///< whole frames that a sensor has no use for
  std::int64_t forbidden = 0;      ///< messages 123 and 124: they overwrite the factory calibration in flash
  std::int64_t broken_frames = 0;  ///< wrong checksum
  std::int64_t skipped_bytes = 0;  ///< outside any frame
};

/// The receiving side of the simulated sensor: the host's bytes in, commands out. No clock, no device.
class HostListener {
 public:
  /// Throws config::ConfigError for an impossible device.
  HostListener(const DeviceConfig& device, std::uint64_t seed);

  /// The commands that these bytes complete, in their order.
  [[nodiscard]] std::vector<HostCommand> feed(std::span<const std::byte> bytes);

  [[nodiscard]] HostCounters counters() const;

 private:
  void read_request(const l1::Frame& frame, std::vector<HostCommand>& commands);
  void read_time_sync(const l1::Frame& frame, std::vector<HostCommand>& commands);
  void read_mode(const l1::Frame& frame, std::vector<HostCommand>& commands);
  void read_led(const l1::Frame& frame, std::vector<HostCommand>& commands);
  [[nodiscard]] bool goes_unheard();

  DeviceConfig device_;
  std::mt19937_64 random_;
  l1::FrameParser parser_;
  HostCounters counters_;
};

}  // namespace ignis::sim
