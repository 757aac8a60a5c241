// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "common/time.h"
#include "messages/lcm_log.h"

namespace ignis {

/// What the processes of a live run published, as it lies in the log: encoded, in the order of the log, as long-lived
/// as the log. Empty in a log of sensor data alone.
struct RecordedResults {
  using Messages = std::vector<std::span<const std::byte>>;
  Messages scan_stats;
  Messages keyframes;
  Messages states;
  Messages revisions;
  Messages smoothed_states;
  Messages loops;
  std::optional<std::int32_t> first_session;  ///< of the front end: it may have begun anew before the log did
  std::optional<Utime> first_command;         ///< [us] somebody took a loop out of the live graph; a replay does not

  /// Keeps the event when it is one of these.
  void add(const messages::LogEvent& event);
};

}  // namespace ignis
