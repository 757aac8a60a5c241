// SPDX-License-Identifier: Apache-2.0
//
// What a host may send to the simulated sensor, whose end of the line listens to bytes as the driver's does: only
// commands that a sensor knows come of it, each is counted, and how the bytes are cut into pieces changes nothing.

#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "drivers/sim/host_listener.h"
#include "require.h"

namespace {

using namespace ignis;
using fuzz::require;

struct Judge {
  void operator()(const sim::ModeCommand& command) const {
    require(command.mode == l1::WorkingMode::kNormal || command.mode == l1::WorkingMode::kStandby);
  }
  void operator()(const sim::LedCommand& command) const {
    require(command.mode >= l1::LedRing::kTableMode && command.mode <= l1::LedRing::kLastMode);
  }
  void operator()(const auto&) const {}
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto bytes = std::as_bytes(std::span(data + 1, size - 1));
  sim::HostListener whole({}, 1);
  const std::vector<sim::HostCommand> commands = whole.feed(bytes);
  for (const sim::HostCommand& command : commands) std::visit(Judge{}, command);
  const sim::HostCounters counters = whole.counters();
  const auto counted = counters.version_queries + counters.sync_queries + counters.sync_answers +
                       counters.mode_commands + counters.led_commands;
  require(counted == std::ssize(commands));

  const std::size_t cut = data[0] % (bytes.size() + 1);
  sim::HostListener pieces({}, 1);
  require(pieces.feed(bytes.first(cut)).size() + pieces.feed(bytes.subspan(cut)).size() == commands.size());
  return 0;
}
