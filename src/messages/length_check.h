// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "ignis/cloud_t.hpp"
#include "ignis/driver_status_t.hpp"
#include "ignis/graph_command_t.hpp"
#include "ignis/health_t.hpp"
#include "ignis/imu_t.hpp"
#include "ignis/keyframe_request_t.hpp"
#include "ignis/keyframe_t.hpp"
#include "ignis/lio_command_t.hpp"
#include "ignis/loop_result_t.hpp"
#include "ignis/map_status_t.hpp"
#include "ignis/pose_t.hpp"
#include "ignis/scan_stats_t.hpp"
#include "ignis/scan_t.hpp"
#include "ignis/smoothed_keyframes_t.hpp"
#include "ignis/state_t.hpp"
#include "messages/type_name.h"

/// Generated LCM decoders read out of bounds when an array count wraps, and throw on bad string lengths. So the length
/// of a message is checked against its own counts before any decoder sees it.
namespace ignis::messages {

inline constexpr std::size_t kFingerprintBytes = 8;

/// One stretch of an encoded message body (behind the 8-byte fingerprint).
struct LayoutStep {
  enum Kind : std::uint8_t {
    kFixed,    ///< `bytes` of plain fields
    kString,   ///< int32 length including the terminator, then that many bytes
    kCount,    ///< int32 array count, remembered
    kArray,    ///< as many elements of `bytes` each as the last count said
    kStrings,  ///< as many strings as the last count said
  };
  Kind kind;
  std::int32_t bytes = 0;
};

/// True when `body` ends exactly where its layout says, all counts are 0 or more and all strings are terminated.
[[nodiscard]] bool length_is_consistent(std::span<const LayoutStep> layout, std::span<const std::byte> body);

/// The layout of each message type. A test encodes every type and compares.
template <class Message>
inline constexpr std::span<const LayoutStep> kLayout;

namespace layouts {
using enum LayoutStep::Kind;
inline constexpr LayoutStep kImu[] = {{kFixed, 8 + 4 + 24 + 24 + 4 + 1}};
inline constexpr LayoutStep kScan[] = {{kFixed, 8 + 4 + 2 + 2 + 4 + 4}, {kCount}, {kArray, 5 * 4}};
inline constexpr LayoutStep kDriverStatus[] = {
    {kFixed, 8 + 4 + 1}, {kString}, {kFixed, 17 * 8 + 4 + 4 * 8 + 3 * 4 + 4}, {kString}, {kString}};
inline constexpr LayoutStep kState[] = {
    {kFixed, 8 + 4 + 4}, {kString}, {kFixed, (3 + 4 + 3 + 6 + 9) * 8 + 1}, {kCount}, {kArray, 8}};
inline constexpr LayoutStep kScanStats[] = {
    {kFixed, 8 + 3 * 4 + 2}, {kString}, {kFixed, 3 * 4 + 5 * 8 + 3 * 8 + 1 + 8 + 2 + 8 + 7 * 8 + 4 + 8}};
inline constexpr LayoutStep kCloud[] = {{kFixed, 8 + 4 + 2 + 2 + 4 + 1 + 7 * 8}, {kCount}, {kArray, 4 * 4}};
inline constexpr LayoutStep kKeyframe[] = {{kFixed, 8 + 3 * 4 + 2 + 2 + 8 + 2 + (3 + 4 + 3 + 3 + 3 + 225 + 36 + 5) * 8},
                                           {kCount},
                                           {kArray, 7 * 4},
                                           {kCount},
                                           {kFixed, 4},
                                           {kArray, 3 * 2 + 1}};
inline constexpr LayoutStep kKeyframeRequest[] = {{kFixed, 8 + 4 + 4}, {kString}, {kCount}, {kArray, 4}};
inline constexpr LayoutStep kGraphCommand[] = {{kFixed, 8 + 4 + 4 + 1}, {kString}, {kFixed, 4 + 4}};
inline constexpr LayoutStep kLioCommand[] = {{kFixed, 8 + 4 + 4 + 1}, {kString}};
inline constexpr LayoutStep kSmoothedKeyframes[] = {
    {kFixed, 8 + 3 * 4 + 2 + 2 + 1 + 2 * 4 + (3 + 4 + 36) * 8}, {kCount}, {kArray, 4 + 7 * 8}};
inline constexpr LayoutStep kLoopResult[] = {{kFixed, 8 + 5 * 4 + 3}, {kString}, {kFixed, 2 * 4 + 7 * 8 + 7 * 8}};
inline constexpr LayoutStep kMapStatus[] = {{kFixed, 8 + 5 * 4 + 8 + 2 * 4 + 8 + 8 + 4 + 8 + 8}, {kString}};
inline constexpr LayoutStep kPose[] = {{kFixed, 8 + 4 + 10 * 8}};
inline constexpr LayoutStep kHealth[] = {{kFixed, 8 + 4}, {kString},  {kFixed, 4 + 1}, {kString},
                                         {kFixed, 4},     {kString},  {kString},       {kFixed, 9 * 8},
                                         {kCount},        {kStrings}, {kArray, 4 * 8}};
}  // namespace layouts

template <>
inline constexpr std::span<const LayoutStep> kLayout<imu_t> = layouts::kImu;
template <>
inline constexpr std::span<const LayoutStep> kLayout<scan_t> = layouts::kScan;
template <>
inline constexpr std::span<const LayoutStep> kLayout<driver_status_t> = layouts::kDriverStatus;
template <>
inline constexpr std::span<const LayoutStep> kLayout<state_t> = layouts::kState;
template <>
inline constexpr std::span<const LayoutStep> kLayout<scan_stats_t> = layouts::kScanStats;
template <>
inline constexpr std::span<const LayoutStep> kLayout<cloud_t> = layouts::kCloud;
template <>
inline constexpr std::span<const LayoutStep> kLayout<keyframe_t> = layouts::kKeyframe;
template <>
inline constexpr std::span<const LayoutStep> kLayout<keyframe_request_t> = layouts::kKeyframeRequest;
template <>
inline constexpr std::span<const LayoutStep> kLayout<graph_command_t> = layouts::kGraphCommand;
template <>
inline constexpr std::span<const LayoutStep> kLayout<lio_command_t> = layouts::kLioCommand;
template <>
inline constexpr std::span<const LayoutStep> kLayout<smoothed_keyframes_t> = layouts::kSmoothedKeyframes;
template <>
inline constexpr std::span<const LayoutStep> kLayout<loop_result_t> = layouts::kLoopResult;
template <>
inline constexpr std::span<const LayoutStep> kLayout<map_status_t> = layouts::kMapStatus;
template <>
inline constexpr std::span<const LayoutStep> kLayout<pose_t> = layouts::kPose;
template <>
inline constexpr std::span<const LayoutStep> kLayout<health_t> = layouts::kHealth;

/// Whether the stamps leave room for arithmetic: sums and differences of them cannot overflow. 36,000 years.
template <class Message>
[[nodiscard]] bool stamps_are_possible(const Message& message) {
  constexpr std::int64_t kFarthest = std::int64_t{1} << 60;
  const auto possible = [](std::int64_t utime) { return utime > -kFarthest && utime < kFarthest; };
  if constexpr (requires { message.previous_utime; }) {
    if (!possible(message.previous_utime)) return false;
  }
  return possible(message.utime);
}

/// Whether the data is of the type and version and as long as its counts say: what is left to check are the stamps.
template <class Message>
[[nodiscard]] bool is_whole(std::span<const std::byte> data) {
  return data.size() >= kFingerprintBytes && fingerprint_of(data) == static_cast<std::uint64_t>(Message::getHash()) &&
         length_is_consistent(kLayout<Message>, data.subspan(kFingerprintBytes));
}

/// Decodes a whole message, or lets it read itself if it can. False: another type, another version, a body whose length
/// contradicts its counts, or a stamp that no clock shows.
template <class Message>
[[nodiscard]] bool decode_checked(std::span<const std::byte> data, Message& message) {
  if constexpr (requires { message.read(data); }) {
    return message.read(data);
  } else {
    if (!is_whole<Message>(data)) return false;
    const int size = static_cast<int>(data.size());
    return message.decode(data.data(), 0, size) == size && stamps_are_possible(message);
  }
}

}  // namespace ignis::messages
