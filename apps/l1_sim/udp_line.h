// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "host_line.h"

namespace ignis {

/// The sensor behind the vendor's serial-to-UDP board: the same bytes in datagrams to one host. What that host sends
/// back to the same socket are its commands.
class UdpLine final : public HostLine {
 public:
  /// `address`: HOST:PORT, an IPv4 address or a name. Throws runtime::UserError that says what to do.
  explicit UdpLine(const std::string& address);
  ~UdpLine() override;

  /// Datagrams need no reader.
  [[nodiscard]] bool has_reader() const override { return true; }

  /// False when the host's machine has said that nobody listens there.
  bool write(std::span<const std::byte> bytes) override;

  [[nodiscard]] std::size_t read(std::span<std::byte> buffer, Clock::time_point deadline) override;

 private:
  int socket_ = -1;
};

}  // namespace ignis
