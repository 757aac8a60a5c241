// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

#include "messages/keyframe_messages.h"

namespace ignis {

/// The newest keyframes as they were sent, for those who ask for them again. Bounded in number; a keyframe takes what
/// its messages take, about half of the keyframe itself.
class SentKeyframes {
 public:
  explicit SentKeyframes(std::size_t limit) : limit_(limit) {}

  /// Keeps a keyframe, drops the oldest beyond the limit, and returns the messages to send. One of the same number that
  /// a killed process wrote down and never told gives way to it.
  const std::vector<keyframe_t>& add(const Keyframe& keyframe) {
    std::erase_if(sent_, [&](const Sent& sent) { return sent.session == keyframe.session && sent.id == keyframe.id; });
    sent_.push_back({.session = keyframe.session, .id = keyframe.id, .parts = messages::to_messages(keyframe)});
    if (sent_.size() > limit_) sent_.pop_front();
    return sent_.back().parts;
  }

  /// The parts of a keyframe; nullptr when it is no longer, or not yet, there.
  [[nodiscard]] const std::vector<keyframe_t>* find(std::int32_t session, std::int32_t id) const {
    for (const Sent& sent : sent_) {
      if (sent.session == session && sent.id == id) return &sent.parts;
    }
    return nullptr;
  }

  [[nodiscard]] std::size_t size() const { return sent_.size(); }

 private:
  struct Sent {
    std::int32_t session;
    std::int32_t id;
    std::vector<keyframe_t> parts;
  };

  std::size_t limit_;
  std::deque<Sent> sent_;
};

}  // namespace ignis
