// SPDX-License-Identifier: Apache-2.0
#include "sensor_commands.h"

#include <format>
#include <iostream>

#include "drivers/mode_command.h"
#include "runtime/steady_time.h"
#include "runtime/stop_signal.h"

namespace ignis {
namespace {

using runtime::ExitCode;
using runtime::steady_now;

constexpr Utime kVersionRepeat = 500'000;
constexpr Utime kLedRepeat = 100'000;
constexpr Utime kPatience = 5'000'000;
constexpr int kLedLeastSent = 3;

/// Sends `make_frame()` every `repeat` until `done(packets)` or until patience ends. True when done.
template <class MakeFrame, class Done>
bool repeat_until(SensorSession& session, Utime repeat, MakeFrame make_frame, Done done) {
  const Utime began = steady_now();
  Utime last_sent = began - repeat;
  while (!runtime::stop_requested() && steady_now() - began < kPatience) {
    if (steady_now() - last_sent >= repeat) {
      last_sent = steady_now();
      session.write(make_frame());
    }
    if (done(session.read())) return true;
  }
  return false;
}

}  // namespace

ExitCode set_working_mode(SensorSession& session, l1::WorkingMode mode) {
  using Step = l1::ModeCommand::Step;
  const char* name = mode == l1::WorkingMode::kNormal ? "normal mode" : "standby";
  l1::ModeCommand command(mode, session.stream().counters(), steady_now());
  while (!runtime::stop_requested()) {
    (void)session.read();
    switch (command.step(session.stream().counters(), steady_now())) {
      case Step::kSend:
        session.write(session.frames().working_mode(mode));
        break;
      case Step::kConfirmed:
        std::cout << std::format("the sensor is in {} ({} commands sent)\n", name, command.sent());
        return runtime::kDone;
      case Step::kFailed:
        throw runtime::UserError(
            std::format("no sign of {} after {} commands in 10 s: {}", name, command.sent(), session.what_came()),
            runtime::kFailed);
      case Step::kWait:
        break;
    }
  }
  return runtime::kFailed;
}

ExitCode print_version(SensorSession& session) {
  std::optional<l1::Version> version;
  const bool answered = repeat_until(
      session, kVersionRepeat, [&] { return session.frames().version_request(); },
      [&](const std::vector<l1::Packet>& packets) {
        for (const l1::Packet& packet : packets) {
          if (const auto* found = std::get_if<l1::Version>(&packet)) version = *found;
        }
        return version.has_value();
      });
  if (!answered) {
    throw runtime::UserError(std::format("the sensor did not tell its version within 5 s: {}", session.what_came()),
                             runtime::kFailed);
  }
  std::cout << std::format("ranging head: software {}, hardware {}\nbase: software {}, hardware {}\n",
                           version->sys_soft, version->sys_hard, version->com_soft, version->com_hard);
  return runtime::kDone;
}

ExitCode set_led(SensorSession& session, int mode, bool lit) {
  l1::LedRing ring;
  ring.mode = static_cast<std::uint8_t>(mode);
  ring.table.fill(lit ? 0xFF : 0x00);
  const bool wants_pattern = mode != l1::LedRing::kTableMode;
  int sent = 0;
  bool status_seen = false;
  const bool shown = repeat_until(
      session, kLedRepeat,
      [&] {
        ++sent;
        return session.frames().led_ring(ring);
      },
      [&](const std::vector<l1::Packet>& packets) {
        const bool status_here = std::ranges::any_of(
            packets, [](const auto& each) { return std::holds_alternative<l1::AuxiliarySeen>(each); });
        status_seen = status_seen || status_here;
        const bool pattern = (session.stream().housekeeping().work_status & l1::kLedPatternBit) != 0;
        return status_here && sent >= kLedLeastSent && pattern == wants_pattern;
      });
  if (shown) {
    std::cout << std::format("the light ring shows {} ({} commands sent)\n",
                             wants_pattern ? std::format("pattern {}", mode) : (lit ? "all lights" : "no light"), sent);
    return runtime::kDone;
  }
  throw runtime::UserError(status_seen
                               ? std::format("{} commands sent, but the sensor's status does not show them", sent)
                               : std::format("{} commands sent; without scans there is no status to confirm them: {}",
                                             sent, session.what_came()),
                           runtime::kFailed);
}

}  // namespace ignis
