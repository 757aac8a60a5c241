// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "backend/journal/record_archive.h"
#include "common/compact_cloud.h"

namespace ignis {

/// A cloud, or why there is none.
struct CloudLookup {
  std::vector<CloudPoint> points;  ///< body frame
  std::string problem;             ///< empty when all is well
};

/// The keyframes' clouds, of which the most recently used ones are in memory, up to a bound. The others are read back
/// from the archive that holds the graph's changes; without one they are gone. What a cloud looks like does not depend
/// on where it was.
class CloudStore {
 public:
  /// Unbounded.
  CloudStore() = default;

  /// `archive` may be null; else it outlives the store.
  CloudStore(std::size_t most_bytes, const RecordArchive* archive);

  /// Adds the next keyframe's. What exceeds the bound goes before that: the bound may be exceeded by this cloud, by
  /// those that are read back until the next one comes, and by what no record holds yet.
  void add(std::int32_t keyframe, CompactCloud cloud);

  /// The clouds added since the last call are in the archive's record of this number.
  void note_record(std::size_t number);

  /// How many of the first entries such a record is known of.
  [[nodiscard]] std::size_t recorded() const { return recorded_; }

  /// Lets go of entries for good: their indices, ascending. Those behind move up.
  void erase(std::span<const std::size_t> indices);

  /// Of the `index`-th keyframe in the store.
  [[nodiscard]] CloudLookup find(std::size_t index);

  /// The same without looking into the archive; null when it is not in memory.
  [[nodiscard]] const CompactCloud* in_memory(std::size_t index) const;

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] std::size_t bytes_in_memory() const { return bytes_; }
  /// Clouds that went for want of memory and an archive.
  [[nodiscard]] int forgotten() const { return forgotten_; }
  /// Times that a cloud could not be read back.
  [[nodiscard]] int unreadable() const { return unreadable_; }

 private:
  struct Entry {
    std::int32_t keyframe = 0;
    std::optional<std::size_t> record;
    std::optional<CompactCloud> cloud;
    std::uint64_t used = 0;  ///< its key in by_use_ while it is in memory
  };

  void keep(std::size_t index, CompactCloud cloud);
  void touch(std::size_t index);
  void make_room();
  [[nodiscard]] std::optional<CompactCloud> read_back(const Entry& entry) const;

  std::size_t most_bytes_ = SIZE_MAX;
  const RecordArchive* archive_ = nullptr;
  std::vector<Entry> entries_;
  std::map<std::uint64_t, std::size_t> by_use_;  ///< index of each cloud in memory, the one used longest ago first
  std::uint64_t uses_ = 0;
  std::size_t bytes_ = 0;
  std::size_t recorded_ = 0;  ///< entries of which the record is known
  int forgotten_ = 0;
  int unreadable_ = 0;
};

}  // namespace ignis
