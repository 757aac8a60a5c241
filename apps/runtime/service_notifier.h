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

  /// Call at every turn of the main loop. `progress`: what has been handled since start; `now_s` [s of any steady
  /// clock]. The first call says READY. The watchdog is fed only when `progress` has grown since it was fed last: a
  /// loop that hangs in a handler starves it, and so does one that turns without handling anything.
  void turn(std::int64_t progress, double now_s);

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
