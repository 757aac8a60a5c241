// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "drivers/byte_link.h"

namespace ignis::l1 {

/// A serial line or pty, raw, 8N1, without flow control, for this process alone (TIOCEXCL and flock). Not thread safe.
class SerialPort final : public ByteLink {
 public:
  /// Throws LinkError when the port is missing, in use, forbidden, not a terminal, or refuses the speed.
  SerialPort(const std::filesystem::path& device, int baud);
  ~SerialPort() override;

  [[nodiscard]] std::size_t read(std::span<std::byte> buffer, int timeout_ms) override;
  void write(std::span<const std::byte> bytes) override;

 private:
  void claim();
  void configure(int baud);
  [[noreturn]] void lost(const std::string& reason) const;

  std::filesystem::path device_;
  int fd_ = -1;
};

}  // namespace ignis::l1
