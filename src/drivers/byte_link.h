// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>

namespace ignis::l1 {

/// A link that cannot be opened or that is gone. what() says what to do.
class LinkError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The two-way stream of bytes between host and sensor. Not thread safe.
class ByteLink {
 public:
  ByteLink() = default;
  virtual ~ByteLink() = default;
  ByteLink(const ByteLink&) = delete;
  ByteLink& operator=(const ByteLink&) = delete;

  /// Waits at most `timeout_ms` for bytes and reads what is there: 0 on timeout or on a signal.
  /// Throws LinkError when the link is gone.
  [[nodiscard]] virtual std::size_t read(std::span<std::byte> buffer, int timeout_ms) = 0;

  /// Writes all bytes. Throws LinkError when the link is gone or takes nothing for a second.
  virtual void write(std::span<const std::byte> bytes) = 0;

  /// Deliveries refused since the opening because they came from a stranger.
  [[nodiscard]] virtual std::int64_t refused() const { return 0; }
};

/// Opens what driver.port names: "udp://ADDRESS:PORT" listens for the sensor's serial-to-UDP board, everything else is
/// a serial device or pty. Throws LinkError that says what to do.
[[nodiscard]] std::unique_ptr<ByteLink> open_link(const std::string& port, int baud);

}  // namespace ignis::l1
