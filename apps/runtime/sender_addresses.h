// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "runtime/bus_filter.h"
#include "runtime/bus_socket.h"

namespace ignis::runtime {

/// Where each process on the bus sends from. LCM does not hand on a datagram's address, and messages carry no sender;
/// HEALTH names its process, so a socket of our own hears HEALTH a second time, with the addresses.
class SenderAddresses {
 public:
  /// Processes remembered at most: they come from the bus.
  static constexpr std::size_t kMaxProcesses = 64;

  /// Joins the bus beside LCM. Throws std::system_error when that is impossible.
  explicit SenderAddresses(const BusAddress& bus);
  ~SenderAddresses();
  SenderAddresses(const SenderAddresses&) = delete;
  SenderAddresses& operator=(const SenderAddresses&) = delete;

  /// Takes what has arrived since the last call, without waiting.
  void hear();

  /// Where this process sends from. Nothing when it was not heard, or when the address speaks for processes of other
  /// names too: a player of a log is no instance of any of them.
  [[nodiscard]] std::optional<UdpAddress> of(const std::string& process, std::int32_t pid) const;

 private:
  using Process = std::pair<std::string, std::int32_t>;  // name and process id

  void note(std::span<const std::byte> datagram, const UdpAddress& sender);

  int socket_ = -1;
  std::map<Process, UdpAddress> senders_;
};

}  // namespace ignis::runtime
