// SPDX-License-Identifier: Apache-2.0
#include "runtime/bus_socket.h"

#include <array>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <system_error>
#include <vector>

#include <arpa/inet.h>
#include <linux/filter.h>
#include <linux/if_packet.h>
#include <linux/sock_diag.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace ignis::runtime {
namespace {

constexpr std::uint32_t kWholeMessage = 0x4C433032;  // "LC02"; a fragment begins with "LC03"
constexpr std::uint32_t kMagicOffset = 8;            // behind the UDP header
constexpr std::uint32_t kSmallest = 8 + 8 + 2;       // UDP header, LCM header, a channel of one letter

sock_filter load(std::uint32_t offset) { return BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offset); }

sock_filter load_ancillary(std::uint32_t what) {
  return BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(SKF_AD_OFF) + what);
}

/// Classic BPF over the datagram; the accumulator decides: 0 drops it, any other value is the length kept.
std::vector<sock_filter> program(const BusAddress& address) {
  std::vector<sock_filter> code;
  const auto drop_unless = [&](sock_filter jump_over_the_drop) {
    code.push_back(jump_over_the_drop);
    code.push_back(BPF_STMT(BPF_RET | BPF_K, 0));
  };
  code.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_LEN, 0));
  drop_unless(BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, kSmallest, 1, 0));
  code.push_back(load(kMagicOffset));
  drop_unless(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kWholeMessage, 1, 0));
  if (address.stays_home) {
    // Our own come over the loopback interface, or as the kernel's copy of what left through another one.
    code.push_back(load_ancillary(SKF_AD_PKTTYPE));
    code.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PACKET_LOOPBACK, 3, 0));
    code.push_back(load_ancillary(SKF_AD_IFINDEX));
    drop_unless(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, if_nametoindex("lo"), 1, 0));
  }
  code.push_back(BPF_STMT(BPF_RET | BPF_K, 0xFFFFFFFF));
  return code;
}

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
  if (const std::size_t at = rest.find("ttl="); at != std::string::npos) {
    const std::string ttl = rest.substr(at + 4, rest.find('&', at) - at - 4);
    address.stays_home = number_of(ttl).value_or(1) == 0;
  }
  return address;
}

std::optional<BusSocket> BusSocket::guard(const BusAddress& address) {
  const std::vector<int> sockets = bus_sockets(address.port);
  if (sockets.empty()) return std::nullopt;
  std::vector<sock_filter> code = program(address);
  const sock_fprog filter{.len = static_cast<unsigned short>(code.size()), .filter = code.data()};
  for (const int descriptor : sockets) {
    if (setsockopt(descriptor, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter) != 0) {
      throw std::system_error(errno, std::system_category(), "the filter in front of the bus");
    }
  }
  return BusSocket(sockets.back());
}

std::uint32_t BusSocket::dropped() const {
  std::array<std::uint32_t, SK_MEMINFO_VARS> info{};
  socklen_t length = sizeof info;
  if (getsockopt(descriptor_, SOL_SOCKET, SO_MEMINFO, info.data(), &length) != 0) return 0;
  return info[SK_MEMINFO_DROPS];
}

}  // namespace ignis::runtime
