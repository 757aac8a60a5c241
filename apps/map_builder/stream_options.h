// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/stream.hpp>

namespace ignis {

/// How our end of a WebSocket behaves: what it sends at once, how long a handshake may take, how much it takes in. The
/// echo server of the conformance suite (test/map/websocket_echo.cpp) has the same, with a larger limit.
inline void set_stream_options(boost::beast::websocket::stream<boost::beast::tcp_stream>& stream,
                               std::size_t max_inbound_bytes) {
  namespace websocket = boost::beast::websocket;
  constexpr std::chrono::seconds kHandshakeTimeout{5};
  boost::beast::error_code ignored;
  boost::beast::get_lowest_layer(stream).socket().set_option(boost::asio::ip::tcp::no_delay(true), ignored);
  // Only the handshakes are timed here: an idle timer that counts what arrives would end slow readers (check_life).
  stream.set_option(websocket::stream_base::timeout{kHandshakeTimeout, websocket::stream_base::none(), false});
  stream.read_message_max(max_inbound_bytes);
  stream.auto_fragment(false);  // control frames can wait for one map frame; 4 kB pieces would cost a call each
}

}  // namespace ignis
