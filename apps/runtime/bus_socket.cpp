// SPDX-License-Identifier: Apache-2.0
#include "runtime/bus_socket.h"

#include <array>
#include <charconv>
#include <filesystem>
#include <format>
#include <vector>

#include <arpa/inet.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace ignis::runtime {
namespace {

bool is_bus_socket(int descriptor, std::uint16_t port) {
  int type = 0;
  socklen_t length = sizeof type;
  if (getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &length) != 0 || type != SOCK_DGRAM) return false;
  sockaddr_in bound{};
  length = sizeof bound;
  if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&bound), &length) != 0) return false;
  return bound.sin_family == AF_INET && ntohs(bound.sin_port) == port;
}

std::optional<int> number_of(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<std::string> option_in(const std::string& url, std::string_view name) {
  const std::size_t at = url.find(name);
  if (at == std::string::npos) return std::nullopt;
  return url.substr(at + name.size(), url.find('&', at) - at - name.size());
}

/// LCM keeps its socket to itself, so it is looked up among this process's own.
std::vector<int> bus_sockets(std::uint16_t port) {
  std::vector<int> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const std::optional<int> descriptor = number_of(entry.path().filename().string());
    if (descriptor && is_bus_socket(*descriptor, port)) found.push_back(*descriptor);
  }
  return found;
}

/// One spelling for each address; what is none stays as it is, for LCM to refuse.
std::string written_once(const std::string& group) {
  in_addr address{};
  std::array<char, INET_ADDRSTRLEN> text{};
  if (inet_aton(group.c_str(), &address) == 0) return group;
  return inet_ntop(AF_INET, &address, text.data(), text.size());
}

}  // namespace

std::optional<BusAddress> BusAddress::parse(const std::string& url) {
  constexpr std::string_view kScheme = "udpm://";
  if (!url.starts_with(kScheme)) return std::nullopt;
  const std::string rest = url.substr(kScheme.size());
  const std::string host = rest.substr(0, rest.find('?'));
  const std::size_t colon = host.find(':');
  BusAddress address;
  if (const std::string group = host.substr(0, colon); !group.empty()) address.group = written_once(group);
  if (colon != std::string::npos) {
    const std::optional<int> port = number_of(host.substr(colon + 1));
    if (!port || *port < 1 || *port > 65535) return std::nullopt;
    address.port = static_cast<std::uint16_t>(*port);
  }
  if (const std::optional<std::string> ttl = option_in(rest, "ttl=")) {
    address.stays_home = number_of(*ttl).value_or(1) == 0;
  }
  if (const std::optional<std::string> bytes = option_in(rest, "recv_buf_size=")) {
    address.receive_buffer = number_of(*bytes).value_or(0);
  }
  return address;
}

std::string BusAddress::shortage(int given) const {
  if (given >= receive_buffer) return {};
  return std::format("the kernel gave {} of {} bytes for what waits on the bus (net.core.rmem_max)", given,
                     receive_buffer);
}

std::optional<BusSocket> BusSocket::guard(const BusAddress& address) {
  const std::vector<int> sockets = bus_sockets(address.port);
  if (sockets.empty()) return std::nullopt;
  const BusFilter filter{.stays_home = address.stays_home};
  for (const int descriptor : sockets) filter.attach(descriptor);
  return BusSocket(sockets.back(), filter);
}

void BusSocket::ignore(const std::vector<UdpAddress>& senders) {
  if (senders == filter_.unheard) return;
  filter_.unheard = senders;
  filter_.attach(descriptor_);
}

int BusSocket::receive_buffer() const {
  int doubled = 0;  // Linux counts its own overhead too
  socklen_t length = sizeof doubled;
  if (getsockopt(descriptor_, SOL_SOCKET, SO_RCVBUF, &doubled, &length) != 0) return 0;
  return doubled / 2;
}

std::uint32_t BusSocket::dropped() const {
  std::array<std::uint32_t, SK_MEMINFO_VARS> info{};
  socklen_t length = sizeof info;
  if (getsockopt(descriptor_, SOL_SOCKET, SO_MEMINFO, info.data(), &length) != 0) return 0;
  return info[SK_MEMINFO_DROPS];
}

}  // namespace ignis::runtime
