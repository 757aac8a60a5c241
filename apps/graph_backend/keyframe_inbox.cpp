// SPDX-License-Identifier: Apache-2.0
#include "keyframe_inbox.h"

namespace ignis {
namespace {

constexpr std::chrono::milliseconds kGapPeriod{300};
constexpr std::chrono::seconds kQuietPeriod{1};
constexpr std::size_t kMaxIdsPerRequest = 16;
// With 30 % of the datagrams lost, request and two parts get through in one of three attempts.
constexpr int kMaxRequests = 40;

}  // namespace

void KeyframeInbox::put(Keyframe keyframe, Time now) {
  last_arrival_ = now;
  waiting_.insert_or_assign(keyframe.id, std::move(keyframe));
}

std::optional<Keyframe> KeyframeInbox::take(std::int32_t expected) {
  if (waiting_.empty() || waiting_.begin()->first > expected) return std::nullopt;
  Keyframe keyframe = std::move(waiting_.begin()->second);
  waiting_.erase(waiting_.begin());
  return keyframe;
}

std::vector<std::int32_t> KeyframeInbox::ids_to_request(std::int32_t expected, Time now) {
  std::vector<std::int32_t> ids;
  const bool has_gap = !waiting_.empty();
  if (now - last_request_ < kGapPeriod) return ids;
  if (!has_gap && (now - last_request_ < kQuietPeriod || now - last_arrival_ < kQuietPeriod)) return ids;
  last_request_ = now;
  if (has_gap) {
    if (requested_id_ != expected) requests_ = 0;
    requested_id_ = expected;
    ++requests_;
  }
  for (std::int32_t id = expected; ids.size() < kMaxIdsPerRequest; ++id) {
    if (has_gap && id >= waiting_.rbegin()->first) break;
    if (!waiting_.contains(id)) ids.push_back(id);
  }
  return ids;
}

std::optional<std::int32_t> KeyframeInbox::hopeless_before(std::int32_t expected) const {
  if (waiting_.empty() || requested_id_ != expected || requests_ <= kMaxRequests) return std::nullopt;
  return waiting_.begin()->first;
}

}  // namespace ignis
