// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace ignis {

/// Where a smoother's changes are kept, so that it can look up what it no longer holds in memory.
class RecordArchive {
 public:
  virtual ~RecordArchive() = default;

  /// What Smoother::take_change() gave at its `number`-th call, counted from 0 over all processes that resumed the
  /// graph. Nothing when it was not kept, cannot be read or is damaged.
  [[nodiscard]] virtual std::optional<std::vector<std::byte>> read(std::size_t number) const = 0;
};

}  // namespace ignis
