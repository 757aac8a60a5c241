// SPDX-License-Identifier: Apache-2.0
//
// An echo server with the stream options of map_builder's viewers, for the Autobahn test suite (docs/reliability.md,
// row W3), which asks a server to return what it gets, up to 16 MB. On 127.0.0.1; prints its port; serves until it is
// ended.

#include <iostream>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/flat_buffer.hpp>

#include "map_builder/stream_options.h"

namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
using Stream = beast::websocket::stream<beast::tcp_stream>;
using net::ip::tcp;

constexpr auto kNoThrow = net::as_tuple(net::use_awaitable);
constexpr std::size_t kMaxInboundBytes = 16 * 1024 * 1024;

net::awaitable<void> echo(tcp::socket socket) {
  Stream stream{beast::tcp_stream(std::move(socket))};
  ignis::set_stream_options(stream, kMaxInboundBytes);
  if (const auto [refused] = co_await stream.async_accept(kNoThrow); refused) co_return;
  beast::flat_buffer buffer;
  while (true) {
    if (const auto [failed, bytes] = co_await stream.async_read(buffer, kNoThrow); failed) co_return;
    stream.text(stream.got_text());
    if (const auto [failed, bytes] = co_await stream.async_write(buffer.data(), kNoThrow); failed) co_return;
    buffer.consume(buffer.size());
  }
}

net::awaitable<void> accept_all(tcp::acceptor acceptor) {
  while (true) {
    auto [failed, socket] = co_await acceptor.async_accept(kNoThrow);
    if (!failed) net::co_spawn(acceptor.get_executor(), echo(std::move(socket)), net::detached);
  }
}

}  // namespace

int main() {
  net::io_context context(1);
  tcp::acceptor acceptor(context, {net::ip::make_address("127.0.0.1"), 0});
  std::cout << acceptor.local_endpoint().port() << std::endl;
  net::co_spawn(context, accept_all(std::move(acceptor)), net::detached);
  context.run();
}
