// SPDX-License-Identifier: Apache-2.0
//
// Logs from strangers as the replay reads them: the index of stamps and parts, what is missing in it, the measurements
// in their order, and the listing. The input is a list of events, since no fuzzer guesses a log's framing; what may
// stand in that is fuzz_lcm_log's.

#include <fuzzer/FuzzedDataProvider.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <format>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <sys/mman.h>
#include <unistd.h>

#include "ignis/health_t.hpp"
#include "ignis/imu_t.hpp"
#include "ignis/scan_t.hpp"
#include "live_agreement.h"
#include "replay_input.h"
#include "require.h"
#include "runtime/channels.h"

namespace {

using namespace ignis;
using fuzz::require;
namespace channels = runtime::channels;

constexpr int kMaxEvents = 64;

template <class Number>
void append(std::vector<char>& log, Number number) {
  number = std::byteswap(number);
  log.insert(log.end(), reinterpret_cast<const char*>(&number), reinterpret_cast<const char*>(&number) + sizeof number);
}

template <class Message>
std::string encoded(const Message& message) {
  std::string data(static_cast<std::size_t>(message.getEncodedSize()), '\0');
  message.encode(data.data(), 0, static_cast<int>(data.size()));
  return data;
}

/// Stamps and numbers are near each other as a rule, and anything at all now and then.
template <class Number>
Number near_or_any(FuzzedDataProvider& input) {
  return input.ConsumeIntegralInRange<int>(0, 15) > 0 ? input.ConsumeIntegral<std::uint8_t>()
                                                      : input.ConsumeIntegral<Number>();
}

std::string message(FuzzedDataProvider& input, std::string& channel) {
  switch (input.ConsumeIntegralInRange<int>(0, 4)) {
    case 0: {
      channel = channels::kImu;
      imu_t imu{};
      imu.utime = near_or_any<std::int64_t>(input);
      imu.sequence = near_or_any<std::int32_t>(input);
      return encoded(imu);
    }
    case 1: {
      channel = channels::kScan;
      scan_t part{};
      part.utime = near_or_any<std::int64_t>(input);
      part.sequence = near_or_any<std::int32_t>(input);
      part.part = near_or_any<std::int16_t>(input);
      part.part_count = near_or_any<std::int16_t>(input);
      return encoded(part);
    }
    case 2: {
      channel = channels::kHealth;
      health_t health{};
      health.utime = near_or_any<std::int64_t>(input);
      health.process = "lio_frontend";
      health.num_receivers = 1;
      health.channels = {channels::kImu};
      for (auto* counts : {&health.received, &health.lost, &health.rejected, &health.queue_drops}) {
        counts->push_back(near_or_any<std::int64_t>(input));
      }
      return encoded(health);
    }
    default: {
      const char* const known[] = {
          channels::kScanStats,  channels::kKeyframe,   channels::kState,         channels::kGroundTruth,
          channels::kLioCommand, channels::kLoopResult, channels::kSmoothedState, "OTHER"};
      channel = input.PickValueInArray(known);
      return input.ConsumeRandomLengthString(512);
    }
  }
}

std::vector<char> log_of(FuzzedDataProvider& input) {
  std::vector<char> log;
  for (int i = 0; i < kMaxEvents && input.remaining_bytes() > 0; ++i) {
    std::string channel;
    const std::string data = message(input, channel);
    append(log, std::uint32_t{0xEDA1DA01});
    append(log, static_cast<std::int64_t>(i));
    append(log, near_or_any<std::int64_t>(input));
    append(log, static_cast<std::int32_t>(channel.size()));
    append(log, static_cast<std::int32_t>(data.size()));
    log.insert(log.end(), channel.begin(), channel.end());
    log.insert(log.end(), data.begin(), data.end());
  }
  return log;
}

void check(const ReplayInput& input) {
  const LogInventory& inventory = input.inventory();
  require(inventory.missing_imu >= 0 && inventory.missing_scans >= 0 && inventory.incomplete_scans >= 0);
  require(inventory.first_utime <= inventory.last_utime);
  Utime before = std::numeric_limits<Utime>::min();
  input.run({.on_imu = [](const ImuSample&) {},
             .on_scan = [](const Scan&) {},
             .on_command = [](const lio_command_t&) {},
             .proceed =
                 [&](Utime utime) {
                   require(utime >= before && utime <= inventory.last_utime);
                   before = utime;
                   return true;
                 }});
  static_cast<void>(agreement_with_live(input.live_results().scan_stats, {}));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const std::vector<char> log = log_of(input);
  const int file = memfd_create("log", 0);
  require(file >= 0 && write(file, log.data(), log.size()) == std::ssize(log));
  try {
    check(ReplayInput(std::format("/proc/self/fd/{}", file)));
  } catch (const std::runtime_error& refused) {
    require(*refused.what() != '\0');  // nothing to replay in it
  }
  close(file);
  return 0;
}
