// SPDX-License-Identifier: Apache-2.0
#include "map_builder/view_client.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <nlohmann/json.hpp>

#include "map/stream_encoding.h"
#include "map_builder/rethrow.h"
#include "map_builder/stream_texts.h"
#include "map_builder/tcp_progress.h"

namespace ignis {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using Clock = std::chrono::steady_clock;

constexpr auto kNoThrow = net::as_tuple(net::use_awaitable);
constexpr int kMaxBadRequests = 20;
constexpr std::size_t kMaxAnswers = 64;
constexpr std::size_t kMaxAnswerBytes = std::size_t{2} << 20;  // four pairs of the largest clouds of a loop
constexpr double kRequestsPerSecond = 20.0;
constexpr double kRequestBurst = 60.0;
constexpr double kRadiusStep = 5.0;  // [m] viewers whose radii fall into one step share pictures and frames
constexpr std::chrono::seconds kLifeTimeout{10};
constexpr std::chrono::milliseconds kSlowRoundTrip{500};

}  // namespace

ViewClient::ViewClient(std::int64_t id, Stream stream, ViewerContext& context)
    : id_(id),
      stream_(std::move(stream)),
      wake_(stream_.get_executor(), net::steady_timer::time_point::max()),
      answered_(stream_.get_executor(), net::steady_timer::time_point::max()),
      context_(context),
      view_radius_(std::min(kDefaultViewRadius, context.max_view_radius_m)),
      requests_(kRequestsPerSecond, kRequestBurst) {}

net::awaitable<void> ViewClient::serve(const Request& upgrade) {
  const auto self = shared_from_this();
  stream_.control_callback([this](websocket::frame_type kind, beast::string_view) { on_control(kind); });
  const auto [refused] = co_await stream_.async_accept(upgrade, kNoThrow);
  if (refused) co_return;
  open_ = true;
  last_life_ = last_progress_ = Clock::now();
  answer({shared(context_.hello()), nullptr});
  context_.on_view_changed();
  net::co_spawn(stream_.get_executor(), [self] { return self->write_loop(); }, kRethrow);
  co_await read_loop();
  close();
}

net::awaitable<void> ViewClient::read_loop() {
  beast::flat_buffer buffer;
  while (open_) {
    const auto [error, bytes] = co_await stream_.async_read(buffer, kNoThrow);
    last_life_ = Clock::now();
    if (error) {
      count_failure(error);
      co_return;
    }
    if (!stream_.got_text()) {
      ++context_.counters.binary_messages;
      co_await refuse(websocket::close_code::unknown_data);
      co_return;
    }
    if (!requests_.allow(last_life_)) too_demanding_ = true;
    if (!too_demanding_) handle(beast::buffers_to_string(buffer.data()));
    buffer.consume(buffer.size());
    // The answer goes out before the next message is looked at, which may be one that ends the connection.
    while (open_ && !answers_.empty() && !answers_.front().binary) co_await answered_.async_wait(kNoThrow);
    if (too_demanding_ || bad_requests_ > kMaxBadRequests) {
      ++context_.counters.policy_closes;
      co_await refuse(websocket::close_code::policy_error);
      co_return;
    }
  }
}

net::awaitable<void> ViewClient::refuse(websocket::close_code code) {
  open_ = false;
  wake();
  co_await stream_.async_close(code, kNoThrow);
}

void ViewClient::count_failure(const beast::error_code& error) {
  if (error == websocket::error::bad_frame_payload) {
    ++context_.counters.invalid_texts;
  } else if (error == websocket::error::message_too_big || error == websocket::error::buffer_overflow) {
    ++context_.counters.oversized;
  } else if (error == websocket::condition::protocol_violation) {
    ++context_.counters.protocol_errors;
  }
}

void ViewClient::on_control(websocket::frame_type kind) {
  last_life_ = Clock::now();
  if (kind == websocket::frame_type::ping && !requests_.allow(last_life_)) {
    // Answering pings costs a write each; a flood of them ends like a flood of requests.
    if (std::exchange(too_demanding_, true)) return;
    ++context_.counters.policy_closes;
    const auto close_it = [self = shared_from_this()] { return self->refuse(websocket::close_code::policy_error); };
    net::co_spawn(stream_.get_executor(), close_it, kRethrow);
  } else if (kind == websocket::frame_type::pong) {
    if (std::exchange(awaits_pong_, false)) round_trip_ = last_life_ - batch_began_;
    wake();
  }
}

void ViewClient::handle(const std::string& text) {
  const auto request = parse_client_request(text, context_.max_view_radius_m);
  if (!request) {
    ++bad_requests_;
    ++context_.counters.bad_requests;
    answer({shared(error_text("bad_request", request.error())), nullptr});
  } else if (const auto* view = std::get_if<ViewRequest>(&*request)) {
    answer({shared(nlohmann::json{{"type", "view"}, {"radius", view->radius_m}}.dump()), nullptr});
    const double served = std::min(context_.max_view_radius_m, kRadiusStep * std::ceil(view->radius_m / kRadiusStep));
    if (std::exchange(view_radius_, served) != served) context_.on_view_changed();
  } else if (std::holds_alternative<ResyncRequest>(*request)) {
    ++context_.counters.resyncs;
    seen_.picture = nullptr;
    wake();
  } else {
    context_.on_request(id_, *request);
  }
}

void ViewClient::answer(Answer answer) {
  if (answers_.size() >= kMaxAnswers || answer_bytes_ + answer.bytes() > kMaxAnswerBytes) {
    too_demanding_ = true;
    return;
  }
  answer_bytes_ += answer.bytes();
  answers_.push_back(std::move(answer));
  note_waiting();
  wake();
}

void ViewClient::note_waiting() {
  std::atomic<std::int64_t>& most = context_.counters.most_waiting_bytes;
  most = std::max(most.load(), static_cast<std::int64_t>(answer_bytes_ + frame_bytes_));
}

void ViewClient::check_life(TimePoint now) {
  if (!open_) return;
  const TcpProgress progress = tcp_progress(beast::get_lowest_layer(stream_).socket().native_handle());
  const bool has_moved = std::exchange(acknowledged_, progress.acknowledged) != progress.acknowledged;
  if (has_moved) last_life_ = now;
  if (has_moved || progress.is_complete) last_progress_ = now;
  // Whoever reads nothing is not alive, however many pongs it sends.
  if (now - std::min(last_life_, last_progress_) < kLifeTimeout) return;
  ++context_.counters.idle_closes;
  close();
}

void ViewClient::close() {
  open_ = false;
  wake();
  answered_.cancel();
  beast::get_lowest_layer(stream_).cancel();
}

net::awaitable<void> ViewClient::write_loop() {
  const auto self = shared_from_this();
  while (open_) {
    wrote_ = false;
    // A failed write ends the writing alone: the reader may be in the middle of telling the viewer why it is closed.
    if (!co_await (awaits_pong_ ? write_short_answers() : write_news())) {
      answers_.clear();
      answer_bytes_ = frame_bytes_ = 0;
      answered_.cancel();
      co_return;
    }
    if (!wrote_ && open_) co_await wake_.async_wait(kNoThrow);
  }
}

net::awaitable<bool> ViewClient::write_news() {
  batch_began_ = Clock::now();
  // Small texts go first: a large frame must not starve the state.
  const bool is_slow = round_trip_ > kSlowRoundTrip;
  if (!is_slow || !frame_is_next_) {
    if (!co_await write_texts()) co_return false;
  }
  frame_is_next_ = wrote_;
  if (!is_slow || !wrote_) {
    if (!co_await write_frame()) co_return false;
  }
  if (!wrote_ || !open_) co_return true;
  awaits_pong_ = true;
  const auto [error] = co_await stream_.async_ping({}, kNoThrow);
  co_return !error;
}

net::awaitable<bool> ViewClient::write_texts() {
  if (!co_await write_answers()) co_return false;
  for (const SharedBytes& text : context_.board.take_texts(seen_)) {
    if (!co_await write_message(false, text)) co_return false;
  }
  co_return true;
}

/// Texts alone need not wait for the pong of the batch before: their number is bounded by what the viewer asks.
net::awaitable<bool> ViewClient::write_short_answers() {
  while (!answers_.empty() && !answers_.front().binary) {
    if (!co_await write_answer()) co_return false;
  }
  co_return true;
}

net::awaitable<bool> ViewClient::write_answers() {
  while (!answers_.empty()) {
    if (!co_await write_answer()) co_return false;
  }
  co_return true;
}

net::awaitable<bool> ViewClient::write_answer() {
  const Answer answer = answers_.front();
  const bool written =
      co_await write_message(false, answer.text) && (!answer.binary || co_await write_message(true, answer.binary));
  answer_bytes_ -= answer.bytes();
  answers_.pop_front();
  answered_.cancel();
  co_return written;
}

net::awaitable<bool> ViewClient::write_frame() {
  const SharedPicture picture = context_.board.picture(view_radius_);
  if (!picture || picture == seen_.picture) co_return true;
  if (seen_.picture && shows_the_same(*seen_.picture, *picture)) {
    seen_.picture = picture;
    co_return true;
  }
  const StreamFrame frame = context_.frames.frame(seen_.picture, picture);
  if (seen_.picture) context_.counters.pictures_skipped += picture->number - seen_.picture->number - 1;
  seen_.picture = picture;
  ++sequence_;
  frame_bytes_ = frame.bytes->size();
  note_waiting();
  if (!co_await write_message(false, shared(frame_text(*picture, frame.is_snapshot, sequence_)))) co_return false;
  if (!co_await write_message(true, frame.bytes)) co_return false;
  frame_bytes_ = 0;
  ++(frame.is_snapshot ? context_.counters.snapshots : context_.counters.deltas);
  context_.counters.frame_bytes += static_cast<std::int64_t>(frame.bytes->size());
  co_return true;
}

net::awaitable<bool> ViewClient::write_message(bool binary, SharedBytes message) {
  wrote_ = true;
  stream_.binary(binary);
  const auto [error, bytes] = co_await stream_.async_write(net::buffer(*message), kNoThrow);
  co_return !error;
}

}  // namespace ignis
