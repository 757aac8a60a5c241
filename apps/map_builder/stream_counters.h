// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace ignis {

/// Counters over all viewers since the start; written by the server's thread, read by any.
struct StreamCounters {
  std::atomic<std::int64_t> snapshots = 0;
  std::atomic<std::int64_t> deltas = 0;
  std::atomic<std::int64_t> frame_bytes = 0;
  std::atomic<std::int64_t> pictures_skipped = 0;  ///< pictures that a viewer was too slow to get
  std::atomic<std::int64_t> resyncs = 0;
  std::atomic<std::int64_t> most_waiting_bytes = 0;  ///< that waited at once for one viewer: its frame and its answers

  // What was refused. Those below the first close the connection with the code in brackets.
  std::atomic<std::int64_t> bad_requests = 0;
  std::atomic<std::int64_t> protocol_errors = 0;  ///< RFC 6455 violated (1002)
  std::atomic<std::int64_t> binary_messages = 0;  ///< (1003)
  std::atomic<std::int64_t> invalid_texts = 0;    ///< not UTF-8 (1007)
  std::atomic<std::int64_t> policy_closes = 0;    ///< too many bad or too frequent requests (1008)
  std::atomic<std::int64_t> oversized = 0;        ///< (1009)
  std::atomic<std::int64_t> idle_closes = 0;      ///< nothing moved on the connection
  std::atomic<std::int64_t> refused_upgrades = 0;
  std::atomic<std::int64_t> refused_http = 0;  ///< answered 4xx or 5xx
};

}  // namespace ignis
