// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace ignis::runtime {

/// Tells the supervisor, where there is one, how this process is doing.
///
/// systemd: READY, STATUS and WATCHDOG over NOTIFY_SOCKET. s6: a line on the file descriptor that IGNIS_READY_FD names
/// says that the process is ready. Without either, nothing happens.
class ServiceNotifier {
 public:
  ServiceNotifier();

  /// Whether a supervisor started this process: it can tell over the bus what is wrong, instead of ending with a
  /// message that nobody reads and being started again.
  [[nodiscard]] static bool is_supervised();

  /// The main loop turns: the first call says READY. `now_s` [s of any steady clock].
  void turn(std::int64_t progress, double now_s);

  /// Feeds the watchdog when `progress`, what has been done since start, has grown since it was fed last: a loop that
  /// hangs in a handler starves it, and so does one that turns without handling anything. Nothing before READY.
  void feed(std::int64_t progress, double now_s);

  /// One line for `systemctl status`.
  void status(const std::string& text) const;

 private:
  void say_ready();

  double watchdog_period_s_ = 0.0;  // 0: no watchdog
  bool ready_ = false;
  std::int64_t fed_with_ = 0;
  double last_fed_s_ = 0.0;
};

}  // namespace ignis::runtime
