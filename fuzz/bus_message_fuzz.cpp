// SPDX-License-Identifier: Apache-2.0
//
// Whatever a stranger may put on one of our channels, as every receiver of ours takes it: length check, generated
// decoder, stamps, collection of parts, conversion to the cores' structs. The first byte chooses the type; from half of
// the inputs the fingerprint is made good first, since no fuzzer guesses it.

#include <cstdint>
#include <cstring>
#include <memory>
#include <type_traits>
#include <vector>

#include "messages/graph_messages.h"
#include "messages/keyframe_messages.h"
#include "messages/length_check.h"
#include "messages/odometry_messages.h"
#include "messages/sensor_messages.h"
#include "messages/type_name.h"
#include "require.h"

namespace {

using namespace ignis;
using fuzz::require;

/// Receivers that live on, as in a process: parts of earlier inputs wait in them.
struct Receivers {
  messages::EncodedScanAssembler scans;
  messages::CloudAssembler clouds;
  messages::KeyframeAssembler keyframes;
  messages::RevisionAssembler revisions;
};

void convert(const auto&, Receivers&) {}
void convert(const imu_t& message, Receivers&) { (void)messages::from_message(message); }
void convert(const state_t& message, Receivers&) { (void)messages::from_message(message); }
void convert(const scan_stats_t& message, Receivers&) { (void)messages::from_message(message); }
void convert(const messages::ScanPart& part, Receivers& to) {
  const auto kept = std::make_shared<const std::vector<std::byte>>(part.data.begin(), part.data.end());
  if (const auto scan = to.scans.add(*kept, kept)) (void)scan->read().end_utime();
}
void convert(const cloud_t& message, Receivers& to) { (void)to.clouds.add(message); }
void convert(const keyframe_t& message, Receivers& to) { (void)to.keyframes.add(message); }
void convert(const smoothed_keyframes_t& message, Receivers& to) { (void)to.revisions.add(message); }

std::vector<std::byte> with_fingerprint(std::span<const std::byte> body, std::int64_t fingerprint) {
  std::vector<std::byte> data(8);
  for (std::size_t i = 0; i < 8; ++i) data[i] = static_cast<std::byte>(fingerprint >> (56 - 8 * i));
  data.insert(data.end(), body.begin(), body.end());
  return data;
}

template <class Message>
void check(std::span<const std::byte> data, Receivers& receivers) {
  Message message;
  if (!messages::decode_checked(data, message)) return;
  if constexpr (requires { message.getEncodedSize(); }) {
    // What was taken is what stands there: encoded again it has the same length.
    require(message.getEncodedSize() == static_cast<int>(data.size()));
    require(messages::type_name(messages::fingerprint_of(data)) == Message::getTypeName());
  }
  convert(message, receivers);
}

template <class... Types>
void check_nth(std::size_t chosen, bool make_good, std::span<const std::byte> bytes, Receivers& receivers) {
  std::size_t number = 0;
  const auto each = [&]<class Message>(std::type_identity<Message>) {
    if (number++ != chosen % sizeof...(Types)) return;
    if (make_good) {
      check<Message>(with_fingerprint(bytes, Message::getHash()), receivers);
    } else {
      check<Message>(bytes, receivers);
    }
  };
  (each(std::type_identity<Types>{}), ...);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Receivers receivers;
  if (size == 0) return 0;
  check_nth<cloud_t, driver_status_t, graph_command_t, health_t, imu_t, keyframe_request_t, keyframe_t, lio_command_t,
            loop_result_t, map_status_t, pose_t, scan_stats_t, scan_t, smoothed_keyframes_t, state_t,
            messages::ScanPart>(data[0] >> 1, (data[0] & 1) != 0, std::as_bytes(std::span(data + 1, size - 1)),
                                receivers);
  return 0;
}
