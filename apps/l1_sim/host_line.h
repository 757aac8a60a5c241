// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <span>

namespace ignis {

/// The sensor's end of a two-way line to the host. Not thread safe.
class HostLine {
 public:
  using Clock = std::chrono::steady_clock;

  HostLine() = default;
  virtual ~HostLine() = default;
  HostLine(const HostLine&) = delete;
  HostLine& operator=(const HostLine&) = delete;

  /// True while somebody is there to take bytes, as far as the line can tell.
  [[nodiscard]] virtual bool has_reader() const = 0;

  /// Sends bytes. False when they, or a part of them, were not taken: a sensor does not wait.
  virtual bool write(std::span<const std::byte> bytes) = 0;

  /// Waits for bytes of the host, at the longest until `deadline`, and reads them; 0 when none came.
  [[nodiscard]] virtual std::size_t read(std::span<std::byte> buffer, Clock::time_point deadline) = 0;
};

}  // namespace ignis
