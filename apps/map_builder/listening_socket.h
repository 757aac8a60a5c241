// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

namespace ignis {

/// The socket on which viewers connect. When a service manager passes one in (the socket activation of systemd:
/// LISTEN_FDS=1, LISTEN_PID absent or this process, descriptor 3), that one; otherwise a new one on address and port.
/// Throws runtime::UserError with one sentence that says what to do.
[[nodiscard]] boost::asio::ip::tcp::acceptor open_listening_socket(boost::asio::io_context& context,
                                                                   const std::string& address, int port);

}  // namespace ignis
