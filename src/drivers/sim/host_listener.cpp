// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/host_listener.h"

#include "common/config_check.h"

namespace ignis::sim {
namespace {

constexpr std::uint32_t kSetMeasureParametersId = 123;
constexpr std::uint32_t kSetSystemParametersId = 124;

const DeviceConfig& checked(const DeviceConfig& device) {
  config::require_valid(device, "device");
  return device;
}

}  // namespace

HostListener::HostListener(const DeviceConfig& device, std::uint64_t seed) : device_(checked(device)), random_(seed) {}

std::vector<HostCommand> HostListener::feed(std::span<const std::byte> bytes) {
  std::vector<HostCommand> commands;
  parser_.feed(bytes, 0);
  while (const auto frame = parser_.next()) {
    switch (frame->id) {
      case l1::kRequestDataId:
        read_request(*frame, commands);
        break;
      case l1::kTimeSyncId:
        read_time_sync(*frame, commands);
        break;
      case l1::kWorkingModeId:
        read_mode(*frame, commands);
        break;
      case l1::kLedId:
        read_led(*frame, commands);
        break;
      case kSetMeasureParametersId:
      case kSetSystemParametersId:
        ++counters_.forbidden;
        break;
      default:
        ++counters_.unknown;
    }
  }
  return commands;
}

HostCounters HostListener::counters() const {
  HostCounters counters = counters_;
  counters.broken_frames = parser_.counters().crc_errors;
  counters.skipped_bytes = parser_.counters().skipped_bytes;
  // A sensor does not sign, nor does it understand who does.
  counters.unknown += parser_.counters().signed_frames;
  return counters;
}

void HostListener::read_request(const l1::Frame& frame, std::vector<HostCommand>& commands) {
  switch (static_cast<l1::DataRequest>(l1::decode_byte(frame.payload))) {
    case l1::DataRequest::kVersion:
      ++counters_.version_queries;
      commands.emplace_back(VersionQuery{});
      break;
    case l1::DataRequest::kClockSync:
      ++counters_.sync_queries;
      commands.emplace_back(SyncQuery{});
      break;
    default:
      ++counters_.unknown;
  }
}

void HostListener::read_time_sync(const l1::Frame& frame, std::vector<HostCommand>& commands) {
  const l1::TimeSync message = l1::decode_time_sync(frame.payload);
  if (message.type != l1::TimeSync::kResponse) {
    ++counters_.unknown;
    return;
  }
  ++counters_.sync_answers;
  commands.emplace_back(SyncAnswer{message.count});
}

void HostListener::read_mode(const l1::Frame& frame, std::vector<HostCommand>& commands) {
  const auto mode = static_cast<l1::WorkingMode>(l1::decode_byte(frame.payload));
  if (mode != l1::WorkingMode::kNormal && mode != l1::WorkingMode::kStandby) {
    ++counters_.unknown;
    return;
  }
  if (goes_unheard()) return;
  ++counters_.mode_commands;
  commands.emplace_back(ModeCommand{mode});
}

void HostListener::read_led(const l1::Frame& frame, std::vector<HostCommand>& commands) {
  const std::uint8_t mode = l1::decode_led_ring(frame.payload).mode;
  if (mode < l1::LedRing::kTableMode || mode > l1::LedRing::kLastMode) {
    ++counters_.unknown;
    return;
  }
  if (goes_unheard()) return;
  ++counters_.led_commands;
  commands.emplace_back(LedCommand{mode});
}

bool HostListener::goes_unheard() {
  const bool unheard = std::bernoulli_distribution(device_.ignore_commands)(random_);
  counters_.ignored += unheard ? 1 : 0;
  return unheard;
}

}  // namespace ignis::sim
