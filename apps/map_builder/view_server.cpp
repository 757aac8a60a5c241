// SPDX-License-Identifier: Apache-2.0
#include "map_builder/view_server.h"

#include <chrono>
#include <format>
#include <optional>
#include <tuple>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include "map/stream_encoding.h"
#include "map_builder/listening_socket.h"
#include "map_builder/request_answers.h"
#include "map_builder/rethrow.h"
#include "map_builder/stream_options.h"

namespace ignis {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;

constexpr auto kNoThrow = net::as_tuple(net::use_awaitable);
constexpr std::chrono::seconds kRequestTimeout{5};
constexpr std::chrono::seconds kIdleTimeout{10};
constexpr std::chrono::milliseconds kAcceptPause{100};
constexpr std::uint32_t kMaxHeaderBytes = 8 * 1024;
constexpr std::size_t kMaxInboundBytes = 64 * 1024;
constexpr int kSpareConnections = 16;    // beside the viewers: pages and status requests
constexpr int kSendBuffer = 256 * 1024;  // [bytes] per viewer in the kernel: more would only hold what is no longer new
constexpr double kHttpPerSecond = 100.0;
constexpr double kHttpBurst = 300.0;
constexpr std::chrono::seconds kWatchPeriod{1};

/// Stops counting a connection when its coroutine ends, however it ends.
class ConnectionCount {
 public:
  explicit ConnectionCount(int& count) : count_(count) { ++count_; }
  ~ConnectionCount() { --count_; }
  ConnectionCount(const ConnectionCount&) = delete;
  ConnectionCount& operator=(const ConnectionCount&) = delete;

 private:
  int& count_;
};

}  // namespace

ViewServer::ViewServer(const runtime::HmiConfig& config, StreamTerms terms)
    : config_(config),
      terms_(std::move(terms)),
      http_requests_(kHttpPerSecond, kHttpBurst),
      acceptor_(open_listening_socket(context_, config.address, config.port)) {
  viewers_.max_view_radius_m = config_.max_view_radius_m;
  viewers_.hello = [this] { return hello_text(terms_, viewers_.board.session(), viewers_.board.revision()); };
  viewers_.on_view_changed = [this] {
    update_radii();
    view_changed_ = true;
  };
  viewers_.on_request = [this](std::int64_t viewer, ClientRequest request) {
    const std::lock_guard lock(mutex_);
    if (requests_.size() < kMaxRequests) requests_.push_back({viewer, request});
  };
  net::co_spawn(context_, accept_loop(), kRethrow);
  net::co_spawn(context_, watch_viewers(), kRethrow);
  thread_ = std::thread([this] { serve(); });
}

void ViewServer::serve() {
  try {
    context_.run();
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
  }
}

ViewServer::~ViewServer() {
  context_.stop();
  thread_.join();
  // From here on only the coroutines hold viewers, and they go with the context: no socket may outlive it.
  clients_.clear();
}

std::string ViewServer::address() const {
  const auto endpoint = acceptor_.local_endpoint();
  const std::string host = endpoint.address().to_string();
  return std::format("http://{}:{}/", endpoint.address().is_v6() ? '[' + host + ']' : host, endpoint.port());
}

std::set<double> ViewServer::view_radii() const {
  const std::lock_guard lock(mutex_);
  return radii_;
}

void ViewServer::update_radii() {
  std::set<double> radii;
  for (const auto& [id, client] : clients_) radii.insert(client->view_radius());
  const std::lock_guard lock(mutex_);
  radii_ = std::move(radii);
}

std::vector<ViewerRequest> ViewServer::take_requests() {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
  return std::exchange(requests_, {});
}

void ViewServer::publish(ViewUpdate update) {
  net::post(context_, [this, update = std::move(update)]() mutable {
    if (viewers_.board.apply(std::move(update))) viewers_.frames.clear();
    for (const auto& [id, client] : clients_) client->wake();
  });
}

void ViewServer::answer(std::int64_t viewer, Answer answer) {
  net::post(context_, [this, viewer, answer = std::move(answer)]() mutable {
    const auto found = clients_.find(viewer);
    if (found != clients_.end()) found->second->answer(std::move(answer));
  });
}

net::awaitable<void> ViewServer::watch_viewers() {
  net::steady_timer timer(context_);
  while (true) {
    timer.expires_after(kWatchPeriod);
    co_await timer.async_wait(kNoThrow);
    for (const auto& [id, client] : clients_) client->check_life(std::chrono::steady_clock::now());
  }
}

net::awaitable<void> ViewServer::accept_loop() {
  while (acceptor_.is_open()) {
    auto [error, socket] = co_await acceptor_.async_accept(kNoThrow);
    if (!error) {
      net::co_spawn(context_, serve_connection(std::move(socket)), kRethrow);
      continue;
    }
    // Out of descriptors: wait until a viewer leaves instead of spinning.
    net::steady_timer pause(context_, kAcceptPause);
    co_await pause.async_wait(kNoThrow);
  }
}

net::awaitable<void> ViewServer::serve_connection(Socket socket) {
  const ConnectionCount counted(connections_);
  beast::tcp_stream stream(std::move(socket));
  if (connections_ > config_.max_clients + kSpareConnections) {
    stream.expires_after(kRequestTimeout);
    const Response response = refusal(http::status::service_unavailable, "too many connections; try again later");
    co_await http::async_write(stream, response, kNoThrow);
    co_return;
  }
  co_await serve_requests(stream);
}

net::awaitable<void> ViewServer::serve_requests(beast::tcp_stream& stream) {
  beast::flat_buffer buffer;
  bool keep_alive = true;
  while (keep_alive) {
    http::request_parser<http::empty_body> parser;
    parser.header_limit(kMaxHeaderBytes);
    stream.expires_after(kRequestTimeout);
    const auto [error, bytes] = co_await http::async_read(stream, buffer, parser, kNoThrow);
    const bool is_malformed = error && error.category() == http::make_error_code(http::error::bad_method).category() &&
                              error != http::error::end_of_stream && error != http::error::partial_message;
    if (error && !is_malformed) co_return;
    bool refused = is_malformed;
    Response response = refusal(http::status::bad_request, "the request is malformed or has a body");
    if (!is_malformed && websocket::is_upgrade(parser.get())) {
      response = refuse_upgrade(parser.get(), refused);
      if (refused) {
        ++viewers_.counters.refused_upgrades;
      } else {
        co_await serve_viewer(std::move(stream), parser.release());
        co_return;
      }
    } else if (!is_malformed) {
      response = answer(parser.get());
    }
    if (http::to_status_class(response.result()) != http::status_class::successful) ++viewers_.counters.refused_http;
    keep_alive = !refused && parser.keep_alive();
    response.keep_alive(keep_alive);
    http::response_serializer<http::string_body> serializer(response);
    stream.expires_after(kIdleTimeout);
    // A HEAD request gets the same header and no body.
    const auto [write_error, written] = !is_malformed && parser.get().method() == http::verb::head
                                            ? co_await http::async_write_header(stream, serializer, kNoThrow)
                                            : co_await http::async_write(stream, serializer, kNoThrow);
    if (write_error) co_return;
  }
  beast::error_code ignored;
  std::ignore = stream.socket().shutdown(net::ip::tcp::socket::shutdown_send, ignored);
}

ViewServer::Response ViewServer::answer(const Request& request) {
  if (!http_requests_.allow(std::chrono::steady_clock::now())) {
    return refusal(http::status::too_many_requests, "too many requests; try again in a second");
  }
  return page_or_refusal(request, config_.allowed_origin, *viewers_.board.api_status());
}

ViewServer::Response ViewServer::refuse_upgrade(const Request& request, bool& refused) const {
  std::optional<Response> reason = refusal_of_stream(request, config_.allowed_origin);
  if (!reason && std::ssize(clients_) >= config_.max_clients) {
    reason = refusal(http::status::service_unavailable, "all viewer places are taken; try again later");
  }
  refused = reason.has_value();
  return std::move(reason).value_or(Response{});
}

net::awaitable<void> ViewServer::serve_viewer(beast::tcp_stream stream, Request request) {
  stream.expires_never();  // the WebSocket has its own timers
  beast::error_code ignored;
  stream.socket().set_option(net::socket_base::send_buffer_size(kSendBuffer), ignored);
  ViewClient::Stream upgraded(std::move(stream));
  set_stream_options(upgraded, kMaxInboundBytes);
  upgraded.set_option(websocket::stream_base::decorator(
      [](websocket::response_type& response) { response.set(http::field::sec_websocket_protocol, kStreamProtocol); }));
  const auto client = std::make_shared<ViewClient>(++next_client_, std::move(upgraded), viewers_);
  // The place is taken before the handshake ends, so that nobody slips past the limit meanwhile.
  clients_[client->id()] = client;
  client_count_ = static_cast<int>(clients_.size());
  update_radii();
  co_await client->serve(request);
  clients_.erase(client->id());
  client_count_ = static_cast<int>(clients_.size());
  update_radii();
}

}  // namespace ignis
