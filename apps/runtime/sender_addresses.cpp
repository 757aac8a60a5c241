// SPDX-License-Identifier: Apache-2.0
#include "runtime/sender_addresses.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>
#include <system_error>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "messages/length_check.h"
#include "runtime/channels.h"

namespace ignis::runtime {
namespace {

constexpr std::size_t kLargestDatagram = 65536;
constexpr std::size_t kLcmHeader = 8;     // magic and the sender's running number; channel, NUL and body follow
constexpr std::size_t kLongestName = 64;  // ours are shorter
constexpr int kDatagramsAtOnce = 256;     // a flood of HEALTH must not hold the main loop

[[noreturn]] void give_up(const char* what) { throw std::system_error(errno, std::system_category(), what); }

sockaddr_in socket_address(const BusAddress& bus) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(bus.port);
  if (inet_pton(AF_INET, bus.group.c_str(), &address.sin_addr) != 1) {
    throw std::system_error(EINVAL, std::system_category(), "the group of the bus");
  }
  return address;
}

void join(int descriptor, const BusAddress& bus) {
  const sockaddr_in address = socket_address(bus);
  const int yes = 1;
  if (setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0) give_up("sharing the port of the bus");
  if (bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    give_up("the port of the bus");
  const ip_mreq membership{.imr_multiaddr = address.sin_addr, .imr_interface = {.s_addr = INADDR_ANY}};
  if (setsockopt(descriptor, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
    give_up("the group of the bus");
  }
}

}  // namespace

SenderAddresses::SenderAddresses(const BusAddress& bus)
    : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
  if (socket_ < 0) give_up("a socket for the addresses on the bus");
  try {
    BusFilter{.stays_home = bus.stays_home, .health_only = true}.attach(socket_);
    join(socket_, bus);
  } catch (...) {
    ::close(socket_);
    throw;
  }
}

SenderAddresses::~SenderAddresses() { ::close(socket_); }

void SenderAddresses::hear(const Listener& listener) {
  std::array<std::byte, kLargestDatagram> buffer;
  for (int i = 0; i < kDatagramsAtOnce; ++i) {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t size =
        recvfrom(socket_, buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&from), &length);
    if (size < 0) return;
    note(std::span(buffer).first(static_cast<std::size_t>(size)),
         {.ip = ntohl(from.sin_addr.s_addr), .port = ntohs(from.sin_port)}, listener);
  }
}

void SenderAddresses::note(std::span<const std::byte> datagram, const UdpAddress& sender, const Listener& listener) {
  const std::size_t body = kLcmHeader + std::string_view(channels::kHealth).size() + 1;
  health_t message;
  if (datagram.size() < body || !messages::decode_checked(datagram.subspan(body), message)) return;
  if (message.process.size() > kLongestName) return;
  std::pair heard{sender, message.process};
  // Processes come and go; whoever is there still is heard again within a second.
  if (senders_.size() >= kMaxSenders && !senders_.contains(heard)) senders_.clear();
  senders_.insert(std::move(heard));
  listener(message, sender);
}

bool SenderAddresses::speaks_for_others(const UdpAddress& sender, const std::string& process) const {
  return std::ranges::any_of(senders_,
                             [&](const auto& heard) { return heard.first == sender && heard.second != process; });
}

}  // namespace ignis::runtime
