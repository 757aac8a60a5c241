// SPDX-License-Identifier: Apache-2.0
#include "map_builder/listening_socket.h"

#include <cstdlib>
#include <format>
#include <string_view>

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "runtime/application.h"

namespace ignis {
namespace {

namespace net = boost::asio;
using net::ip::tcp;
using runtime::UserError;

constexpr int kFirstPassedDescriptor = 3;  // SD_LISTEN_FDS_START of sd_listen_fds(3)

bool socket_was_passed() {
  const char* count = std::getenv("LISTEN_FDS");
  if (count == nullptr) return false;
  const char* pid = std::getenv("LISTEN_PID");
  if (pid != nullptr && std::to_string(getpid()) != pid) return false;
  if (std::string_view(count) != "1") {
    throw UserError(std::format("LISTEN_FDS={} is not supported; pass exactly one listening socket", count));
  }
  return true;
}

tcp::acceptor adopt_passed_socket(net::io_context& context) {
  int listening = 0;
  socklen_t size = sizeof listening;
  sockaddr_storage name{};
  socklen_t name_size = sizeof name;
  const int fd = kFirstPassedDescriptor;
  if (getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &listening, &size) != 0 || listening != 1 ||
      getsockname(fd, reinterpret_cast<sockaddr*>(&name), &name_size) != 0 ||
      (name.ss_family != AF_INET && name.ss_family != AF_INET6)) {
    throw UserError("LISTEN_FDS is set, but descriptor 3 is not a listening TCP socket; unset LISTEN_FDS or pass one");
  }
  fcntl(fd, F_SETFD, FD_CLOEXEC);
  tcp::acceptor acceptor(context);
  acceptor.assign(name.ss_family == AF_INET6 ? tcp::v6() : tcp::v4(), fd);
  return acceptor;
}

}  // namespace

tcp::acceptor open_listening_socket(net::io_context& context, const std::string& address, int port) {
  if (socket_was_passed()) return adopt_passed_socket(context);
  boost::system::error_code error;
  const auto parsed = net::ip::make_address(address, error);
  if (error) throw UserError(std::format("hmi.address \"{}\" is not an IP address, such as 127.0.0.1", address));
  const tcp::endpoint endpoint(parsed, static_cast<net::ip::port_type>(port));
  tcp::acceptor acceptor(context);
  acceptor.open(endpoint.protocol());
  acceptor.set_option(net::socket_base::reuse_address(true));
  acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
  if (error == net::error::address_in_use) {
    throw UserError(std::format("port {} on {} is in use; stop the program that uses it, or choose another one with "
                                "--port or hmi.port",
                                port, address),
                    runtime::kFailed);
  }
  if (error) {
    throw UserError(std::format("cannot listen on {} port {}: {}; choose another with --port or hmi.address", address,
                                port, error.message()),
                    runtime::kFailed);
  }
  return acceptor;
}

}  // namespace ignis
