// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/bus_filter.h"

namespace ignis::runtime {

/// What the bus's URL says about the datagrams that may come in. What it leaves out is LCM's default.
struct BusAddress {
  std::string group = "239.255.76.67";  ///< as inet_ntop() writes it
  std::uint16_t port = 7667;
  bool stays_home = true;  ///< ttl=0: nobody sends to another computer, so nothing from one is ours
  int receive_buffer = 0;  ///< [bytes] that LCM asks the kernel for; 0: whatever that gives

  /// Nothing for buses that are no UDP multicast, such as memq.
  static std::optional<BusAddress> parse(const std::string& url);

  /// What to tell of a socket that was given so many bytes; empty when they are as many as were asked for.
  [[nodiscard]] std::string shortage(int given) const;
};

/// Stands in front of LCM's receiving socket with a BusFilter in the kernel. What is refused, and what found the buffer
/// full, the kernel counts.
class BusSocket {
 public:
  /// Finds the socket that LCM has bound in this process and puts the filter on it. Nothing when there is none (no
  /// subscription yet, another kind of bus). Throws std::system_error when the kernel refuses the filter.
  static std::optional<BusSocket> guard(const BusAddress& address);

  /// From now on takes HEALTH alone from these senders, and everything from all others.
  void ignore(const std::vector<UdpAddress>& senders);

  /// [bytes] that the kernel gave for what waits to be received: net.core.rmem_max cuts off what is asked beyond it,
  /// and LCM does not mind.
  [[nodiscard]] int receive_buffer() const;

  /// Datagrams that the kernel has dropped at this socket: refused by the filter, or the buffer was full.
  [[nodiscard]] std::uint32_t dropped() const;

 private:
  BusSocket(int descriptor, BusFilter filter) : descriptor_(descriptor), filter_(std::move(filter)) {}

  int descriptor_;  // LCM's; it lives as long as the link
  BusFilter filter_;
};

}  // namespace ignis::runtime
