// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "common/time.h"
#include "messages/length_check.h"
#include "recorded_results.h"

namespace ignis {

/// How many of the messages that a live run left on a channel its replay would have sent as well.
struct ChannelAgreement {
  std::int64_t recorded = 0;           ///< within what was replayed
  std::int64_t equal = 0;              ///< of these, bit for bit
  std::optional<Utime> first_unequal;  ///< [us] earliest stamp of one that differs or that the replay does not have

  void add(Utime utime, bool is_equal) {
    ++recorded;
    equal += is_equal ? 1 : 0;
    if (!is_equal && (!first_unequal || utime < *first_unequal)) first_unequal = utime;
  }
};

template <class Message>
[[nodiscard]] std::vector<std::byte> encoded(const Message& message) {
  std::vector<std::byte> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Whether a recorded message is what the replay would have sent; the running number is the live sender's.
template <class Message>
[[nodiscard]] bool is_as_sent(Message replayed, std::span<const std::byte> recorded, const Message& decoded) {
  replayed.sequence = decoded.sequence;
  return std::ranges::equal(encoded(replayed), recorded);
}

/// The recorded messages of one channel, found again by a key that both runs share. One that was sent more than once
/// counts as often.
template <class Message, class Key>
class RecordedChannel {
 public:
  RecordedChannel(const RecordedResults::Messages& recorded, Key (*key_of)(const Message&)) : key_of_(key_of) {
    for (const std::span<const std::byte> data : recorded) {
      Message message;
      if (messages::decode_checked(data, message)) entries_.insert({key_of(message), {message.utime, data}});
    }
  }

  [[nodiscard]] bool holds(const Key& key) const { return entries_.contains(key); }

  /// What the replay would have sent.
  void compare(const Message& replayed) {
    const auto [begin, end] = entries_.equal_range(key_of_(replayed));
    for (auto entry = begin; entry != end; ++entry) {
      Message message;
      entry->second.equal =
          messages::decode_checked(entry->second.data, message) && is_as_sent(replayed, entry->second.data, message);
    }
  }

  /// Of the messages stamped up to `until` [us].
  [[nodiscard]] ChannelAgreement agreement(Utime until) const {
    ChannelAgreement agreement;
    for (const auto& [key, entry] : entries_) {
      if (entry.utime <= until) agreement.add(entry.utime, entry.equal);
    }
    return agreement;
  }

 private:
  struct Entry {
    Utime utime = 0;
    std::span<const std::byte> data;
    bool equal = false;
  };
  Key (*key_of_)(const Message&);
  std::multimap<Key, Entry> entries_;
};

}  // namespace ignis
