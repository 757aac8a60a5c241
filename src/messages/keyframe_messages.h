// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/keyframe.h"
#include "ignis/keyframe_t.hpp"
#include "messages/part_assembler.h"

/// LIO_KEYFRAME.
namespace ignis::messages {

/// A keyframe as numbered parts of one datagram each. Coordinates are rounded to a resolution of 1 mm (coarser when the
/// cloud reaches beyond 32 m), IMU samples to float.
[[nodiscard]] std::vector<keyframe_t> to_messages(const Keyframe& keyframe);

/// Puts the parts of keyframes together again. A request is answered with up to 16 keyframes in one go, and where the
/// network lets their parts overtake each other all of them are on their way at once. Parts that come again behind a
/// whole keyframe are no keyframe that waits, unless all of them do: then it is handed over again, for whoever has put
/// it aside. Bounded: of more than 32 keyframes or kMostParts parts, repeats go first, and then the keyframe that has
/// waited longest for its next part is given up.
class KeyframeAssembler {
 public:
  /// A complete keyframe, or nothing yet.
  [[nodiscard]] std::optional<Keyframe> add(const keyframe_t& part);
  /// Keyframes that were given up because a part never came, or not in time.
  [[nodiscard]] std::int64_t incomplete() const { return incomplete_; }
  /// Parts that came again although their keyframe was whole already.
  [[nodiscard]] std::int64_t repeated() const { return repeated_; }
  [[nodiscard]] std::size_t parts_waiting() const;

 private:
  struct Open {
    std::int32_t session;
    std::int32_t id;
    PartAssembler<keyframe_t> parts;
    bool was_whole = false;
  };

  Open& open_for(const keyframe_t& part);
  void drop_one();

  std::deque<Open> open_;  ///< and those that were whole lately; the last one is that of the newest part
  std::int64_t incomplete_ = 0;
  std::int64_t repeated_ = 0;
};

}  // namespace ignis::messages
