// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/mavlink_frame.h"

namespace ignis::l1 {

/// Makes the frames that a host sends to the sensor, with one running sequence number. These are all that exist here:
/// messages 123 and 124 overwrite the factory calibration in flash, 12 reboots or writes flash, and none of them can be
/// made.
class HostFrames {
 public:
  [[nodiscard]] std::vector<std::byte> version_request();
  /// The answer to the sensor's time-sync request of this count.
  [[nodiscard]] std::vector<std::byte> time_sync_answer(std::uint32_t count);
  [[nodiscard]] std::vector<std::byte> working_mode(WorkingMode mode);
  [[nodiscard]] std::vector<std::byte> led_ring(const LedRing& ring);

 private:
  [[nodiscard]] std::vector<std::byte> frame(std::uint32_t id, const Payload& payload);

  std::uint8_t sequence_ = 0;
};

}  // namespace ignis::l1
