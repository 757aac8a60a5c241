// SPDX-License-Identifier: Apache-2.0
#include "keyframe_inbox.h"

#include <iterator>
#include <limits>
#include <utility>

namespace ignis {
namespace {

constexpr std::chrono::milliseconds kGapPeriod{300};
constexpr std::chrono::seconds kQuietPeriod{1};
constexpr std::size_t kMaxIdsPerRequest = 16;
// With 30 % of the datagrams lost, request and two parts get through in one of three attempts.
constexpr int kMaxRequests = 40;

}  // namespace

void KeyframeInbox::clear() {
  const std::int64_t dropped = dropped_;
  *this = {};
  dropped_ = dropped;
}

bool KeyframeInbox::is_far_ahead(std::int32_t id, std::int32_t expected) const {
  const std::int64_t newest = waiting_.empty() ? expected : waiting_.rbegin()->first;
  return id > newest + kMostAhead;
}

void KeyframeInbox::hold(Keyframe keyframe) {
  waiting_.insert_or_assign(keyframe.id, std::move(keyframe));
  if (waiting_.size() <= kMostWaiting) return;
  waiting_.erase(std::prev(waiting_.end()));
  ++dropped_;
}

bool KeyframeInbox::put(Keyframe keyframe, std::int32_t expected, Time now) {
  if (is_far_ahead(keyframe.id, expected)) {
    // After a long absence that is where the drive is by now.
    std::optional<Keyframe> before = std::exchange(put_aside_, std::nullopt);
    const bool carries_on = before && keyframe.id - 1 == before->id && keyframe.previous_utime == before->state.utime;
    if (!carries_on) {
      put_aside_ = std::move(keyframe);
      return false;
    }
    hold(std::move(*before));
  }
  last_arrival_ = now;
  hold(std::move(keyframe));
  return true;
}

std::optional<Keyframe> KeyframeInbox::take(std::int32_t expected) {
  if (waiting_.empty() || waiting_.begin()->first > expected) return std::nullopt;
  return std::move(waiting_.extract(waiting_.begin()).mapped());
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
  // Behind the last id there is none.
  const std::int32_t end = has_gap ? waiting_.rbegin()->first : std::numeric_limits<std::int32_t>::max();
  for (std::int32_t id = expected; id < end && ids.size() < kMaxIdsPerRequest; ++id) {
    if (!waiting_.contains(id)) ids.push_back(id);
  }
  return ids;
}

std::optional<std::int32_t> KeyframeInbox::hopeless_before(std::int32_t expected) const {
  if (waiting_.empty() || requested_id_ != expected || requests_ <= kMaxRequests) return std::nullopt;
  return waiting_.begin()->first;
}

}  // namespace ignis
