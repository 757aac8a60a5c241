// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "map/client_request.h"
#include "map_builder/frame_cache.h"
#include "map_builder/stream_counters.h"
#include "map_builder/view_board.h"
#include "runtime/rate_limit.h"

namespace ignis {

/// What all viewers share. Belongs to the server's thread.
struct ViewerContext {
  ViewBoard board;
  FrameCache frames;
  StreamCounters counters;
  double max_view_radius_m = 0.0;
  std::function<std::string()> hello;
  std::function<void()> on_view_changed;
  std::function<void(std::int64_t viewer, ClientRequest request)> on_request;  ///< those that the map's thread answers
};

/// An answer to one viewer's request: a text, and perhaps the binary message that it announces.
struct Answer {
  SharedBytes text;
  SharedBytes binary;

  [[nodiscard]] std::size_t bytes() const { return text->size() + (binary ? binary->size() : 0); }
};

/// One viewer. It goes and comes with the board: write what is newest, send a ping behind it, wait for the pong, look
/// again. So at most one batch is under way, whatever buffers lie between, and what a slow viewer gets was newest when
/// its previous batch had arrived. A batch is texts and a frame; a viewer that takes long gets texts and frames in
/// turn, so that no frame ages behind texts. Answers that wait meanwhile are bounded in number and bytes: who asks for
/// more than it reads is closed. All calls on the server's thread.
class ViewClient : public std::enable_shared_from_this<ViewClient> {
 public:
  using Stream = boost::beast::websocket::stream<boost::beast::tcp_stream>;
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;
  using TimePoint = std::chrono::steady_clock::time_point;

  ViewClient(std::int64_t id, Stream stream, ViewerContext& context);

  /// Accepts the upgrade and serves the viewer until it leaves.
  boost::asio::awaitable<void> serve(const Request& upgrade);

  /// The board has news.
  void wake() { wake_.cancel(); }
  void answer(Answer answer);
  /// Closes a connection on which nothing has moved for too long.
  void check_life(TimePoint now);
  void close();

  [[nodiscard]] std::int64_t id() const { return id_; }
  [[nodiscard]] double view_radius() const { return view_radius_; }

 private:
  boost::asio::awaitable<void> read_loop();
  boost::asio::awaitable<void> refuse(boost::beast::websocket::close_code code);
  boost::asio::awaitable<void> write_loop();
  boost::asio::awaitable<bool> write_news();
  boost::asio::awaitable<bool> write_texts();
  boost::asio::awaitable<bool> write_short_answers();
  boost::asio::awaitable<bool> write_answers();
  boost::asio::awaitable<bool> write_answer();
  boost::asio::awaitable<bool> write_frame();
  boost::asio::awaitable<bool> write_message(bool binary, SharedBytes message);
  void on_control(boost::beast::websocket::frame_type kind);
  void handle(const std::string& text);
  void note_waiting();
  void count_failure(const boost::beast::error_code& error);

  std::int64_t id_;
  Stream stream_;
  boost::asio::steady_timer wake_;      // ends its wait when there is news
  boost::asio::steady_timer answered_;  // and this one when an answer is out
  ViewerContext& context_;
  double view_radius_;
  ViewBoard::Seen seen_;
  std::deque<Answer> answers_;
  std::size_t answer_bytes_ = 0;  // of these
  std::size_t frame_bytes_ = 0;   // of the frame that is being written
  std::int64_t sequence_ = 0;     // of the last frame sent
  RateLimit requests_;
  int bad_requests_ = 0;
  bool too_demanding_ = false;  // asks faster than allowed, or does not read its answers
  bool open_ = false;
  bool awaits_pong_ = false;
  bool wrote_ = false;
  bool frame_is_next_ = false;  // of a slow viewer
  TimePoint batch_began_{};
  std::chrono::steady_clock::duration round_trip_{};  // of the last batch
  TimePoint last_life_ = std::chrono::steady_clock::now();
  TimePoint last_progress_ = last_life_;  // with what it is sent
  std::uint64_t acknowledged_ = 0;
};

}  // namespace ignis
