// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/keyframe.h"

namespace ignis {

/// Keyframes that arrived before their predecessors, and when to ask for those again. Ids come from the bus: one that
/// is far ahead of all others is put aside until the next one carries on from it, so that a single damaged one leaves
/// no gap that nobody can close.
class KeyframeInbox {
 public:
  using Time = std::chrono::steady_clock::time_point;

  static constexpr std::size_t kMostWaiting = 50;   ///< the highest are dropped: they are asked for again
  static constexpr std::int32_t kMostAhead = 1000;  ///< ids beyond the newest known one

  /// False when it was put aside.
  [[nodiscard]] bool put(Keyframe keyframe, std::int32_t expected, Time now);
  void clear();
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  /// Keyframes for which there was no room.
  [[nodiscard]] std::int64_t dropped() const { return dropped_; }

  /// The first one, when its id is at most `expected`.
  [[nodiscard]] std::optional<Keyframe> take(std::int32_t expected);

  /// Ids to ask for now, perhaps none: those that are missing before the newest; and, when it has been quiet for a
  /// while, those that come next, since nobody would otherwise notice that the last one before a stop was lost.
  [[nodiscard]] std::vector<std::int32_t> ids_to_request(std::int32_t expected, Time now);

  /// The id before which nothing will come any more: nobody has answered so many requests. Nothing while there is hope.
  [[nodiscard]] std::optional<std::int32_t> hopeless_before(std::int32_t expected) const;

 private:
  [[nodiscard]] bool is_far_ahead(std::int32_t id, std::int32_t expected) const;
  void hold(Keyframe keyframe);

  std::map<std::int32_t, Keyframe> waiting_;
  std::optional<Keyframe> put_aside_;
  std::int64_t dropped_ = 0;
  Time last_request_{};
  Time last_arrival_{};
  std::int32_t requested_id_ = -1;  // of the gap that is being asked for
  int requests_ = 0;                // made for it
};

}  // namespace ignis
