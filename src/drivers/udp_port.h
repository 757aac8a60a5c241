// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string_view>

#include <netinet/in.h>

#include "drivers/byte_link.h"

namespace ignis::l1 {

inline constexpr std::string_view kUdpForm = "udp://ADDRESS:PORT, such as udp://10.10.10.100:5000";

/// Whether a port's name asks for UDP.
[[nodiscard]] bool is_udp(std::string_view port);

/// IPv4 address and port of "udp://ADDRESS:PORT"; nothing when it is not of that form.
[[nodiscard]] std::optional<sockaddr_in> parse_udp_address(std::string_view port);

/// The sensor behind the vendor's serial-to-UDP board: the same bytes in datagrams. Belongs to the sender of the first
/// datagram until that one is silent for a second; datagrams of others are refused. Answers go back to it.
class UdpPort final : public ByteLink {
 public:
  /// Throws LinkError when the address is not this machine's or is taken.
  explicit UdpPort(const sockaddr_in& local);
  ~UdpPort() override;

  [[nodiscard]] std::size_t read(std::span<std::byte> buffer, int timeout_ms) override;
  /// Nothing is sent before the first datagram came: nobody is known to be there.
  void write(std::span<const std::byte> bytes) override;
  [[nodiscard]] std::int64_t refused() const override { return refused_; }

 private:
  [[nodiscard]] bool is_sensor(const sockaddr_in& sender);

  int fd_ = -1;
  std::optional<sockaddr_in> sensor_;
  std::chrono::steady_clock::time_point heard_{};
  std::int64_t refused_ = 0;
};

}  // namespace ignis::l1
