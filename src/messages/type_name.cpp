// SPDX-License-Identifier: Apache-2.0
#include "messages/type_name.h"

#include <format>

#include "messages/length_check.h"

namespace ignis::messages {
namespace {

template <class... Types>
std::string name_among(std::uint64_t fingerprint) {
  std::string name;
  ((static_cast<std::uint64_t>(Types::getHash()) == fingerprint ? void(name = Types::getTypeName()) : void()), ...);
  return name;
}

}  // namespace

std::uint64_t fingerprint_of(std::span<const std::byte> data) {
  std::uint64_t fingerprint = 0;
  if (data.size() < kFingerprintBytes) return fingerprint;
  for (const std::byte byte : data.first(kFingerprintBytes)) {
    fingerprint = (fingerprint << 8) | std::to_integer<std::uint64_t>(byte);
  }
  return fingerprint;
}

std::string type_name(std::uint64_t fingerprint) {
  const std::string name = name_among<cloud_t, driver_status_t, graph_command_t, health_t, imu_t, keyframe_request_t,
                                      keyframe_t, lio_command_t, loop_result_t, map_status_t, pose_t, scan_stats_t,
                                      scan_t, smoothed_keyframes_t, state_t>(fingerprint);
  return name.empty() ? std::format("type 0x{:016x}, which is none of ours", fingerprint) : name;
}

}  // namespace ignis::messages
