// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace ignis::runtime {

/// Whose datagrams: the address and the port that they come from. Each process sends through one socket of its own.
struct UdpAddress {
  std::uint32_t ip = 0;    ///< IPv4, in the order of this computer
  std::uint16_t port = 0;  ///< likewise

  auto operator<=>(const UdpAddress&) const = default;
};

/// Which datagrams of the bus a socket takes. All our messages fit one datagram ("LC02"), so nothing else ever passes:
/// what is refused here costs LCM no buffer (a fragment may announce 256 MB) and never meets its reassembly, which adds
/// offset and size in 32 bits (upstream's pull request 628).
struct BusFilter {
  bool stays_home = true;             ///< refuse what other computers send
  bool health_only = false;           ///< take HEALTH and nothing else
  std::vector<UdpAddress> unheard{};  ///< refuse what these send, except HEALTH

  /// Puts the filter (socket(7), SO_ATTACH_FILTER) in front of a UDP socket in place of the one before. Throws
  /// std::system_error when the kernel refuses it.
  void attach(int descriptor) const;
};

}  // namespace ignis::runtime
