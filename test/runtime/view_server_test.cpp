// SPDX-License-Identifier: Apache-2.0
#include "map_builder/view_server.h"

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "map/stream_encoding.h"

namespace ignis {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;

runtime::HmiConfig on_any_port() {
  runtime::HmiConfig config;
  config.port = 0;
  return config;
}

/// Opens the stream as a browser does.
void connect(websocket::stream<beast::tcp_stream>& viewer, const std::string& address) {
  const std::string port = address.substr(address.rfind(':') + 1);
  const net::ip::tcp::endpoint endpoint(net::ip::make_address("127.0.0.1"),
                                        static_cast<net::ip::port_type>(std::stoi(port)));
  beast::get_lowest_layer(viewer).connect(endpoint);
  viewer.set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
    request.set(beast::http::field::sec_websocket_protocol, kStreamProtocol);
  }));
  viewer.handshake("127.0.0.1:" + std::to_string(endpoint.port()), "/ws/lio_map");
}

/// What take_requests() throws within five seconds.
std::string thrown_by(ViewServer& server) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  try {
    while (std::chrono::steady_clock::now() < deadline) {
      static_cast<void>(server.take_requests());
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(ViewServer, HandsWhatItsOwnThreadThrewToTheMapsThread) {
  StreamTerms terms;
  terms.server_version = "\xff";  // no text: the greeting of a viewer cannot be made
  ViewServer server(on_any_port(), terms);
  net::io_context context;
  websocket::stream<beast::tcp_stream> viewer(context);
  connect(viewer, server.address());
  EXPECT_NE(thrown_by(server).find("invalid UTF-8"), std::string::npos);
}

TEST(ViewServer, GreetsAViewerAndThrowsNothing) {
  ViewServer server(on_any_port(), {});
  net::io_context context;
  websocket::stream<beast::tcp_stream> viewer(context);
  connect(viewer, server.address());
  beast::flat_buffer buffer;
  viewer.read(buffer);
  EXPECT_NE(beast::buffers_to_string(buffer.data()).find("\"hello\""), std::string::npos);
  EXPECT_TRUE(server.take_requests().empty());
}

}  // namespace
}  // namespace ignis
