// SPDX-License-Identifier: Apache-2.0
#include "log_listing.h"

#include <format>

#include "messages/length_check.h"

namespace ignis {
namespace {

template <class... Types>
std::string type_name(std::uint64_t fingerprint) {
  std::string name;
  ((static_cast<std::uint64_t>(Types::getHash()) == fingerprint ? void(name = Types::getTypeName()) : void()), ...);
  return name;
}

std::string describe(std::uint64_t fingerprint) {
  const std::string name =
      type_name<cloud_t, driver_status_t, graph_command_t, health_t, imu_t, keyframe_request_t, keyframe_t,
                loop_result_t, map_status_t, pose_t, scan_stats_t, scan_t, smoothed_keyframes_t, state_t>(fingerprint);
  return name.empty() ? std::format("type 0x{:016x}, which is none of ours", fingerprint) : name;
}

}  // namespace

void LogListing::add(const messages::LogEvent& event) {
  Channel& channel = channels_[std::string(event.channel)];
  ++channel.messages;
  channel.fingerprint = 0;
  for (std::size_t i = 0; i < 8 && i < event.data.size(); ++i) {
    channel.fingerprint = (channel.fingerprint << 8) | std::to_integer<std::uint64_t>(event.data[i]);
  }
}

std::string LogListing::text() const {
  std::string text;
  for (const auto& [name, channel] : channels_) {
    text += std::format("\n  {:24} {:8} messages, {}", name, channel.messages, describe(channel.fingerprint));
  }
  return text;
}

}  // namespace ignis
