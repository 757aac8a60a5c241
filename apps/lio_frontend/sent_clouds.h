// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "messages/odometry_messages.h"

namespace ignis {

/// The newest clouds as they were sent, for a map that was started anew and missed some. Bounded in time and in bytes.
class SentClouds {
 public:
  struct Sent {
    std::vector<cloud_t> parts;              ///< at least one
    std::optional<std::int32_t> keyframe{};  ///< id of the keyframe that was made of the same scan

    [[nodiscard]] const cloud_t& head() const { return parts.front(); }
  };

  /// Keeps what is at most `span` [us of the scans' stamps] older than the newest, and no more than `most_bytes`.
  SentClouds(Utime span, std::size_t most_bytes) : span_(span), most_bytes_(most_bytes) {}

  /// Keeps a cloud, drops the oldest beyond the bounds, and returns the messages to send.
  const std::vector<cloud_t>& add(const messages::PosedCloud& cloud) {
    sent_.push_back({.parts = messages::to_messages(cloud)});
    bytes_ += bytes_of(sent_.back());
    while (sent_.size() > 1 && (cloud.utime - sent_.front().head().utime > span_ || bytes_ > most_bytes_)) {
      bytes_ -= bytes_of(sent_.front());
      sent_.pop_front();
    }
    return sent_.back().parts;
  }

  /// The newest cloud's scan has become a keyframe.
  void note_keyframe(std::int32_t id) { sent_.back().keyframe = id; }

  /// A cloud by its running number; nullptr when it is no longer, or not yet, there.
  [[nodiscard]] const Sent* find(std::int32_t session, std::int32_t number) const {
    for (const Sent& sent : sent_) {
      if (sent.head().session == session && sent.head().sequence == number) return &sent;
    }
    return nullptr;
  }

  [[nodiscard]] std::size_t size() const { return sent_.size(); }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  static std::size_t bytes_of(const Sent& sent) {
    std::size_t bytes = 0;
    for (const cloud_t& part : sent.parts) bytes += sizeof(cloud_t) + 4 * sizeof(float) * part.x.size();
    return bytes;
  }

  Utime span_;
  std::size_t most_bytes_;
  std::deque<Sent> sent_;
  std::size_t bytes_ = 0;
};

}  // namespace ignis
