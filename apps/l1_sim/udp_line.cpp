// SPDX-License-Identifier: Apache-2.0
#include "udp_line.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <format>
#include <memory>

#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include "descriptor_wait.h"
#include "runtime/application.h"

namespace ignis {
namespace {

/// What any Ethernet carries in one piece.
constexpr std::size_t kMostBytes = 1400;

struct FreeAddresses {
  void operator()(addrinfo* list) const { freeaddrinfo(list); }
};
using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

Addresses resolve(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const std::string host = text.substr(0, colon);
  const std::string port = colon == std::string::npos ? "" : text.substr(colon + 1);
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int error = host.empty() || port.empty() ? EAI_NONAME : getaddrinfo(host.c_str(), port.c_str(), &hints, &found);
  if (error == 0) return Addresses(found);
  throw runtime::UserError(std::format("--udp {}: {}; give HOST:PORT of the driver, such as 127.0.0.1:5000", text,
                                       error == EAI_NONAME ? "no such address" : gai_strerror(error)));
}

}  // namespace

UdpLine::UdpLine(const std::string& address) {
  const Addresses host = resolve(address);
  socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  // Connected, so that only this host's datagrams come in and its refusals become errors.
  if (socket_ >= 0 && connect(socket_, host->ai_addr, host->ai_addrlen) == 0) return;
  const std::string reason = std::strerror(errno);
  if (socket_ >= 0) close(socket_);
  throw runtime::UserError(std::format("cannot send to {}: {}; is there a route to that host?", address, reason),
                           runtime::kFailed);
}

UdpLine::~UdpLine() { close(socket_); }

bool UdpLine::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const auto part = bytes.first(std::min(bytes.size(), kMostBytes));
    if (send(socket_, part.data(), part.size(), 0) != std::ssize(part)) return false;
    bytes = bytes.subspan(part.size());
  }
  return true;
}

std::size_t UdpLine::read(std::span<std::byte> buffer, Clock::time_point deadline) {
  if (!wait_for_input(socket_, deadline)) return 0;
  const ssize_t count = recv(socket_, buffer.data(), buffer.size(), 0);
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

}  // namespace ignis
