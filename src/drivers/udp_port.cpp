// SPDX-License-Identifier: Apache-2.0
#include "drivers/udp_port.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <format>
#include <string>

namespace ignis::l1 {

namespace {

constexpr std::string_view kScheme = "udp://";
constexpr std::chrono::seconds kOwnership{1};
/// Some seconds of the stream, for a host that is held up: 610 datagrams a second, each of which takes up a kilobyte
/// and more, however small. The kernel may grant less.
constexpr int kReceiveBuffer = 4 * 1024 * 1024;

std::string text_of(const sockaddr_in& address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
  return std::format("{}:{}", text.data(), ntohs(address.sin_port));
}

std::string bind_error(const sockaddr_in& local, int error) {
  switch (error) {
    case EADDRINUSE:
      return std::format("UDP port {} is in use by another process: end it ('ss -ulpn' names it) or use another port",
                         text_of(local));
    case EADDRNOTAVAIL:
      return std::format(
          "{} is not an address of this machine: give an interface the address that the sensor's board sends to "
          "('ip address' shows what there is)",
          text_of(local));
    default:
      return std::format("cannot listen on UDP {}: {}", text_of(local), std::strerror(error));
  }
}

}  // namespace

bool is_udp(std::string_view port) { return port.starts_with(kScheme); }

std::optional<sockaddr_in> parse_udp_address(std::string_view port) {
  if (!is_udp(port)) return std::nullopt;
  port.remove_prefix(kScheme.size());
  const std::size_t colon = port.rfind(':');
  if (colon == std::string_view::npos) return std::nullopt;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  if (inet_pton(AF_INET, std::string(port.substr(0, colon)).c_str(), &address.sin_addr) != 1) return std::nullopt;
  const std::string_view digits = port.substr(colon + 1);
  std::uint16_t number = 0;
  const auto [end, error] = std::from_chars(digits.begin(), digits.end(), number);
  if (error != std::errc{} || end != digits.end() || number == 0) return std::nullopt;
  address.sin_port = htons(number);
  return address;
}

UdpPort::UdpPort(const sockaddr_in& local) : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  if (fd_ < 0) throw LinkError(std::format("cannot make a UDP socket: {}", std::strerror(errno)));
  setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer, sizeof(kReceiveBuffer));
  if (bind(fd_, reinterpret_cast<const sockaddr*>(&local), sizeof(local)) != 0) {
    const int error = errno;
    close(fd_);
    throw LinkError(bind_error(local, error));
  }
}

UdpPort::~UdpPort() { close(fd_); }

std::size_t UdpPort::read(std::span<std::byte> buffer, int timeout_ms) {
  pollfd waiting{.fd = fd_, .events = POLLIN, .revents = 0};
  if (poll(&waiting, 1, timeout_ms) <= 0) return 0;
  sockaddr_in sender{};
  socklen_t size = sizeof(sender);
  const ssize_t count = recvfrom(fd_, buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&sender), &size);
  // An answer that nobody took comes back as an error of the next read; the sensor may still return.
  if (count < 0) return 0;
  if (!is_sensor(sender)) {
    ++refused_;
    return 0;
  }
  return static_cast<std::size_t>(count);
}

bool UdpPort::is_sensor(const sockaddr_in& sender) {
  const auto now = std::chrono::steady_clock::now();
  const bool same =
      sensor_ && sensor_->sin_addr.s_addr == sender.sin_addr.s_addr && sensor_->sin_port == sender.sin_port;
  if (!same && sensor_ && now - heard_ < kOwnership) return false;
  sensor_ = sender;
  heard_ = now;
  return true;
}

void UdpPort::write(std::span<const std::byte> bytes) {
  if (!sensor_) return;
  sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&*sensor_), sizeof(*sensor_));
}

}  // namespace ignis::l1
