// SPDX-License-Identifier: Apache-2.0
#include "drivers/host_frames.h"

namespace ignis::l1 {

std::vector<std::byte> HostFrames::version_request() { return frame(kRequestDataId, encode(DataRequest::kVersion)); }

std::vector<std::byte> HostFrames::time_sync_answer(std::uint32_t count) {
  return frame(kTimeSyncId, encode(TimeSync{count, TimeSync::kResponse}));
}

std::vector<std::byte> HostFrames::working_mode(WorkingMode mode) { return frame(kWorkingModeId, encode(mode)); }

std::vector<std::byte> HostFrames::led_ring(const LedRing& ring) { return frame(kLedId, encode(ring)); }

std::vector<std::byte> HostFrames::frame(std::uint32_t id, const Payload& payload) {
  return encode_frame(id, payload, sequence_++);
}

}  // namespace ignis::l1
