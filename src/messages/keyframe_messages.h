// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// Puts the parts of keyframes together again.
class KeyframeAssembler {
 public:
  /// A complete keyframe, or nothing yet.
  [[nodiscard]] std::optional<Keyframe> add(const keyframe_t& part);
  [[nodiscard]] std::int64_t incomplete() const { return parts_.incomplete(); }

 private:
  PartAssembler<keyframe_t> parts_;
};

}  // namespace ignis::messages
