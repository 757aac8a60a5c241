// SPDX-License-Identifier: Apache-2.0
#include "runtime/instance_lock.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <format>
#include <optional>
#include <string_view>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "runtime/application.h"
#include "runtime/bus_socket.h"

namespace ignis::runtime {

InstanceLock::InstanceLock(const std::string& process, const std::string& url) {
  constexpr std::string_view kScheme = "udpm://";
  if (!url.starts_with(kScheme)) return;
  // The same bus has many spellings, and options behind the address do not make another one. LCM may make something of
  // a spelling that is none of these.
  const std::optional<BusAddress> known = BusAddress::parse(url);
  const std::string bus = known ? std::format("{}:{}", known->group, known->port) : url.substr(kScheme.size());
  const std::string name = std::format("ignis-lio/{}/{}", process, bus);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  // The first byte stays zero: a name of the abstract namespace.
  const std::size_t length = std::min(name.size(), sizeof address.sun_path - 1);
  std::memcpy(address.sun_path + 1, name.data(), length);
  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket_ < 0) throw UserError(std::format("cannot make a socket: {}", std::strerror(errno)), kFailed);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
  if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), size) == 0) return;
  const int error = errno;
  ::close(socket_);
  const std::string why =
      error == EADDRINUSE
          ? std::format("another {} is on the bus udpm://{}; ./ignis status shows its process id", process, bus)
          : std::format("cannot make sure to be alone on the bus: {}", std::strerror(error));
  throw UserError(why, kFailed);
}

InstanceLock::~InstanceLock() {
  if (socket_ >= 0) ::close(socket_);
}

}  // namespace ignis::runtime
