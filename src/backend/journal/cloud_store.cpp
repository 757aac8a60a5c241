// SPDX-License-Identifier: Apache-2.0
#include "backend/journal/cloud_store.h"

#include <algorithm>
#include <format>
#include <utility>

#include "backend/journal/graph_change.h"
#include "backend/keyframes/erase_places.h"

namespace ignis {

CloudStore::CloudStore(std::size_t most_bytes, const RecordArchive* archive)
    : most_bytes_(most_bytes), archive_(archive) {}

void CloudStore::add(std::int32_t keyframe, CompactCloud cloud) {
  make_room();
  entries_.push_back({.keyframe = keyframe, .record = {}, .cloud = {}});
  keep(entries_.size() - 1, std::move(cloud));
}

void CloudStore::note_record(std::size_t number) {
  for (; recorded_ < entries_.size(); ++recorded_) entries_[recorded_].record = number;
}

void CloudStore::erase(std::span<const std::size_t> indices) {
  for (const std::size_t index : indices) {
    if (entries_[index].cloud) bytes_ -= entries_[index].cloud->bytes();
  }
  recorded_ -= static_cast<std::size_t>(std::ranges::lower_bound(indices, recorded_) - indices.begin());
  erase_places(entries_, indices);
  by_use_.clear();
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (entries_[i].cloud) by_use_[entries_[i].used] = i;
  }
}

CloudLookup CloudStore::find(std::size_t index) {
  const Entry& entry = entries_.at(index);
  if (entry.cloud) {
    touch(index);
  } else if (archive_ == nullptr) {
    return {
        {},
        std::format("the cloud of keyframe {} was dropped: backend.cloud_memory_mb, and no journal", entry.keyframe)};
  } else if (std::optional<CompactCloud> cloud = read_back(entry)) {
    keep(index, std::move(*cloud));
  } else {
    ++unreadable_;
    return {{}, std::format("the cloud of keyframe {} cannot be read back", entry.keyframe)};
  }
  return {expanded(*entry.cloud), {}};
}

const CompactCloud* CloudStore::in_memory(std::size_t index) const {
  const Entry& entry = entries_.at(index);
  return entry.cloud ? &*entry.cloud : nullptr;
}

void CloudStore::keep(std::size_t index, CompactCloud cloud) {
  Entry& entry = entries_[index];
  bytes_ += cloud.bytes();
  entry.cloud = std::move(cloud);
  entry.used = uses_++;
  by_use_[entry.used] = index;
}

void CloudStore::touch(std::size_t index) {
  Entry& entry = entries_[index];
  by_use_.erase(entry.used);
  entry.used = uses_++;
  by_use_[entry.used] = index;
}

void CloudStore::make_room() {
  for (auto oldest = by_use_.begin(); bytes_ > most_bytes_ && oldest != by_use_.end();) {
    Entry& entry = entries_[oldest->second];
    if (archive_ != nullptr && !entry.record) {
      ++oldest;
      continue;
    }
    bytes_ -= entry.cloud->bytes();
    entry.cloud.reset();
    if (archive_ == nullptr) ++forgotten_;
    oldest = by_use_.erase(oldest);
  }
}

std::optional<CompactCloud> CloudStore::read_back(const Entry& entry) const {
  const std::optional<std::vector<std::byte>> record = archive_->read(entry.record.value());
  std::optional<GraphChange> change = record ? decode_change(*record) : std::nullopt;
  if (!change) return std::nullopt;
  for (std::size_t i = 0; i < std::min(change->state.nodes.size(), change->clouds.size()); ++i) {
    if (change->state.nodes[i].end.id == entry.keyframe) return std::move(change->clouds[i]);
  }
  return std::nullopt;
}

}  // namespace ignis
