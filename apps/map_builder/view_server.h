// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>

#include "map_builder/stream_texts.h"
#include "map_builder/view_client.h"
#include "runtime/hmi_config.h"

namespace ignis {

/// A request that the map's thread answers, and the viewer who asked.
struct ViewerRequest {
  std::int64_t viewer = 0;
  ClientRequest request;
};

/// HTTP and WebSocket server of the browser view: `GET /` and its files from the built-in table, `GET /api/status`,
/// `WS /ws/lio_map` with the subprotocol of stream_encoding.h. Runs on one thread of its own; the public calls may come
/// from any other thread and never wait for a viewer. What its thread throws (no memory, as a rule) ends the serving,
/// and take_requests() throws it again: a view that is dead must not look alive.
class ViewServer {
 public:
  /// Opens the port. Throws runtime::UserError when it cannot.
  ViewServer(const runtime::HmiConfig& config, StreamTerms terms);
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;

  /// Where the view is served, such as http://127.0.0.1:8080/
  [[nodiscard]] std::string address() const;

  /// The view radii that the connected viewers ask for [m], each once.
  [[nodiscard]] std::set<double> view_radii() const;

  /// True once after a viewer came or changed its radius: it waits for a frame.
  [[nodiscard]] bool take_view_changed() { return view_changed_.exchange(false); }

  /// Puts news on the board; every viewer takes them when it is ready.
  void publish(ViewUpdate update);

  /// What viewers asked for since the last call. At most kMaxRequests wait; further ones are dropped. Throws what the
  /// server's thread has thrown.
  [[nodiscard]] std::vector<ViewerRequest> take_requests();

  /// Answers a viewer, if it is still there.
  void answer(std::int64_t viewer, Answer answer);

  [[nodiscard]] int clients() const { return client_count_; }
  [[nodiscard]] const StreamCounters& counters() const { return viewers_.counters; }

 private:
  static constexpr std::size_t kMaxRequests = 256;
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;
  using Response = boost::beast::http::response<boost::beast::http::string_body>;
  using Socket = boost::asio::ip::tcp::socket;

  void serve();
  boost::asio::awaitable<void> accept_loop();
  boost::asio::awaitable<void> watch_viewers();
  boost::asio::awaitable<void> serve_connection(Socket socket);
  boost::asio::awaitable<void> serve_requests(boost::beast::tcp_stream& stream);
  boost::asio::awaitable<void> serve_viewer(boost::beast::tcp_stream stream, Request request);
  [[nodiscard]] Response answer(const Request& request);
  [[nodiscard]] Response refuse_upgrade(const Request& request, bool& refused) const;
  void update_radii();

  runtime::HmiConfig config_;
  StreamTerms terms_;
  std::atomic<int> client_count_ = 0;
  std::atomic<bool> view_changed_ = false;
  mutable std::mutex mutex_;  // guards the next three
  std::set<double> radii_;
  std::vector<ViewerRequest> requests_;
  std::exception_ptr failure_;  // of the server's thread, which has ended then
  // Below: the server's thread only, but for the counters.
  ViewerContext viewers_;
  std::map<std::int64_t, std::shared_ptr<ViewClient>> clients_;
  std::int64_t next_client_ = 0;
  int connections_ = 0;
  RateLimit http_requests_;
  // The context goes before what its coroutines refer to, and after the sockets in it.
  boost::asio::io_context context_{1};
  boost::asio::ip::tcp::acceptor acceptor_;
  std::thread thread_;
};

}  // namespace ignis
