// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

namespace ignis::l1 {

/// A port that cannot be opened or that is gone. what() says what to do.
class SerialError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A serial line or pty, raw, 8N1, without flow control, for this process alone (TIOCEXCL and flock). Not thread safe.
class SerialPort {
 public:
  /// Throws SerialError when the port is missing, in use, forbidden, not a terminal, or refuses the speed.
  SerialPort(const std::filesystem::path& device, int baud);
  ~SerialPort();
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  /// Waits at most `timeout_ms` for bytes and reads what is there: 0 on timeout or on a signal.
  /// Throws SerialError when the device is gone.
  [[nodiscard]] std::size_t read(std::span<std::byte> buffer, int timeout_ms);

  /// Writes all bytes. Throws SerialError when the device is gone or takes nothing for a second.
  void write(std::span<const std::byte> bytes);

 private:
  void claim();
  void configure(int baud);
  [[noreturn]] void lost(const std::string& reason) const;

  std::filesystem::path device_;
  int fd_ = -1;
};

}  // namespace ignis::l1
