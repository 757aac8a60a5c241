// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/keyframe.h"

namespace ignis {

/// Keyframes that arrived before their predecessors, and when to ask for those again.
class KeyframeInbox {
 public:
  using Time = std::chrono::steady_clock::time_point;

  void put(Keyframe keyframe, Time now);
  void clear() { *this = {}; }
  [[nodiscard]] bool empty() const { return waiting_.empty(); }

  /// The first one, when its id is at most `expected`.
  [[nodiscard]] std::optional<Keyframe> take(std::int32_t expected);

  /// Ids to ask for now, perhaps none: those that are missing before the newest; and, when it has been quiet for a
  /// while, those that come next, since nobody would otherwise notice that the last one before a stop was lost.
  [[nodiscard]] std::vector<std::int32_t> ids_to_request(std::int32_t expected, Time now);

  /// The id before which nothing will come any more: nobody has answered so many requests. Nothing while there is hope.
  [[nodiscard]] std::optional<std::int32_t> hopeless_before(std::int32_t expected) const;

 private:
  std::map<std::int32_t, Keyframe> waiting_;
  Time last_request_{};
  Time last_arrival_{};
  std::int32_t requested_id_ = -1;  // of the gap that is being asked for
  int requests_ = 0;                // made for it
};

}  // namespace ignis
