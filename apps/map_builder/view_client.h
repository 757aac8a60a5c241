// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/stream.hpp>

namespace ignis {

/// A message that several clients share.
using SharedBytes = std::shared_ptr<const std::string>;

/// Counters over all clients; written by the server's thread, read by any.
struct StreamCounters {
  std::atomic<std::int64_t> frames_sent = 0;
  std::atomic<std::int64_t> frames_skipped = 0;
  std::atomic<std::int64_t> refused_requests = 0;
};

/// One viewer. It holds one slot for the newest map frame, one for the newest status text and one for the newest reply;
/// a message that is still waiting is replaced, so a slow viewer gets fewer frames but never old ones, and the memory
/// per viewer is bounded. One write is under way at a time. All calls on the server's thread.
class ViewClient : public std::enable_shared_from_this<ViewClient> {
 public:
  using Stream = boost::beast::websocket::stream<boost::beast::tcp_stream>;
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;

  ViewClient(Stream stream, double max_view_radius, StreamCounters& counters, std::function<void()> on_view_changed);

  /// Accepts the upgrade and serves the viewer until it leaves.
  boost::asio::awaitable<void> serve(const Request& upgrade);

  void offer_frame(SharedBytes frame);
  void offer_status(SharedBytes status);
  void close();

  [[nodiscard]] double view_radius() const { return view_radius_; }

 private:
  boost::asio::awaitable<void> write_loop();
  boost::asio::awaitable<bool> write_one();
  void answer_request(const std::string& text);

  Stream stream_;
  boost::asio::steady_timer wake_;
  double max_view_radius_;
  double view_radius_;
  StreamCounters& counters_;
  std::function<void()> on_view_changed_;
  SharedBytes frame_;
  SharedBytes status_;
  SharedBytes reply_;
  int bad_requests_ = 0;
  bool open_ = false;
};

}  // namespace ignis
