// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace ignis::messages {

/// Most points in one message: five 4-byte arrays of this many stay below 60 kB, so a part is one datagram.
inline constexpr std::int64_t kMaxPointsPerPart = 2900;

/// Most parts of one sequence. A scan of 128 beams has 46 and a keyframe of theirs 12; a part is a datagram of at most
/// 64 kB, so what waits for a part that never comes is at most 64 MB, whoever sends it.
inline constexpr std::int16_t kMostParts = 1024;

/// Whether a message can be the part that it says it is.
[[nodiscard]] bool numbering_is_possible(const auto& part) {
  return part.part_count >= 1 && part.part_count <= kMostParts && part.part >= 0 && part.part < part.part_count;
}

/// Collects the numbered parts of one sequence and hands them over, in order, when the last one is in. A part of a
/// newer sequence ends the wait for the older one, which is then counted as incomplete. Parts of one sequence may
/// arrive in any order and more than once, also behind the last one: what is left of a sequence that has been handed
/// over is no loss.
template <class Message>
class PartAssembler {
 public:
  /// The complete set of parts, or nothing yet. Parts with impossible numbering are ignored and counted as incomplete.
  std::optional<std::vector<Message>> add(const Message& part) {
    if (!numbering_is_possible(part)) {
      ++incomplete_;
      return std::nullopt;
    }
    if (part.part_count == 1) {
      abandon();
      return std::vector<Message>{part};
    }
    if (parts_.empty() || sequence_ != part.sequence || part_count_ != part.part_count) {
      const bool is_repeat = part.sequence == whole_sequence_ && part.part_count == whole_part_count_;
      if (is_repeat && !parts_.empty()) return std::nullopt;
      abandon();
      sequence_ = part.sequence;
      part_count_ = part.part_count;
    }
    parts_.insert_or_assign(part.part, part);
    if (std::ssize(parts_) < part_count_) return std::nullopt;
    whole_sequence_ = sequence_;
    whole_part_count_ = part_count_;
    std::vector<Message> complete;
    complete.reserve(parts_.size());
    for (auto& [number, each] : parts_) complete.push_back(std::move(each));
    parts_.clear();
    return complete;
  }

  /// Parts that wait for others.
  [[nodiscard]] std::size_t waiting() const { return parts_.size(); }

  /// Sequences that were given up because a part never came.
  [[nodiscard]] std::int64_t incomplete() const { return incomplete_; }

 private:
  void abandon() {
    const bool is_repeat = sequence_ == whole_sequence_ && part_count_ == whole_part_count_;
    if (!parts_.empty() && !is_repeat) ++incomplete_;
    parts_.clear();
  }

  // By number, and only those that came: an announced count costs no memory.
  std::map<std::int16_t, Message> parts_;
  std::int64_t incomplete_ = 0;
  std::int32_t sequence_ = 0;
  std::int16_t part_count_ = 0;
  // Of the sequence that was handed over last; no parts: of none.
  std::int32_t whole_sequence_ = 0;
  std::int16_t whole_part_count_ = 0;
};

}  // namespace ignis::messages
