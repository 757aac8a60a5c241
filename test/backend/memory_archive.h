// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "backend/journal/record_archive.h"

namespace ignis::testing {

/// A journal without a file.
struct MemoryArchive : RecordArchive {
  std::vector<std::vector<std::byte>> records;
  mutable int reads = 0;

  [[nodiscard]] std::optional<std::vector<std::byte>> read(std::size_t number) const override {
    ++reads;
    if (number >= records.size()) return std::nullopt;
    return records[number];
  }
};

}  // namespace ignis::testing
