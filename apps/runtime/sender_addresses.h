// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "ignis/health_t.hpp"
#include "runtime/bus_filter.h"
#include "runtime/bus_socket.h"

namespace ignis::runtime {

/// Where each process on the bus sends from. LCM does not hand on a datagram's address, and messages carry no sender:
/// a socket of our own hears HEALTH a second time, with the addresses.
class SenderAddresses {
 public:
  using Listener = std::function<void(const health_t&, const UdpAddress&)>;

  /// Names and addresses remembered at most: they come from the bus.
  static constexpr std::size_t kMaxSenders = 64;

  /// Joins the bus beside LCM. Throws std::system_error when that is impossible.
  explicit SenderAddresses(const BusAddress& bus);
  ~SenderAddresses();
  SenderAddresses(const SenderAddresses&) = delete;
  SenderAddresses& operator=(const SenderAddresses&) = delete;

  /// Tells what has arrived since the last call, without waiting.
  void hear(const Listener& listener);

  /// Whether the address speaks for processes of other names too: a player of a log is no instance of any of them.
  [[nodiscard]] bool speaks_for_others(const UdpAddress& sender, const std::string& process) const;

 private:
  void note(std::span<const std::byte> datagram, const UdpAddress& sender, const Listener& listener);

  int socket_ = -1;
  std::set<std::pair<UdpAddress, std::string>> senders_;
};

}  // namespace ignis::runtime
