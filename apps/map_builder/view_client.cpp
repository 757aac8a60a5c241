// SPDX-License-Identifier: Apache-2.0
#include "map_builder/view_client.h"

#include <cmath>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <nlohmann/json.hpp>

#include "map/view_request.h"

namespace ignis {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
constexpr auto kNoThrow = net::as_tuple(net::use_awaitable);
constexpr int kMaxBadRequests = 20;
constexpr double kRadiusStep = 5.0;  // [m] viewers whose radii fall into one step share an encoded frame

}  // namespace

ViewClient::ViewClient(Stream stream, double max_view_radius, StreamCounters& counters,
                       std::function<void()> on_view_changed)
    : stream_(std::move(stream)),
      wake_(stream_.get_executor(), net::steady_timer::time_point::max()),
      max_view_radius_(max_view_radius),
      view_radius_(std::min(kDefaultViewRadius, max_view_radius)),
      counters_(counters),
      on_view_changed_(std::move(on_view_changed)) {}

net::awaitable<void> ViewClient::serve(const Request& upgrade) {
  const auto self = shared_from_this();
  const auto [refused] = co_await stream_.async_accept(upgrade, kNoThrow);
  if (refused) co_return;
  open_ = true;
  on_view_changed_();
  net::co_spawn(stream_.get_executor(), [self] { return self->write_loop(); }, net::detached);
  beast::flat_buffer buffer;
  while (open_) {
    const auto [error, bytes] = co_await stream_.async_read(buffer, kNoThrow);
    if (error) break;
    answer_request(stream_.got_text() ? beast::buffers_to_string(buffer.data()) : std::string());
    buffer.consume(buffer.size());
    if (bad_requests_ > kMaxBadRequests) {
      co_await stream_.async_close(beast::websocket::close_code::policy_error, kNoThrow);
      break;
    }
  }
  close();
}

void ViewClient::answer_request(const std::string& text) {
  nlohmann::json reply;
  if (const auto radius = parse_view_request(text, max_view_radius_)) {
    reply = {{"type", "view"}, {"radius", *radius}};
    const double served = std::min(max_view_radius_, kRadiusStep * std::ceil(*radius / kRadiusStep));
    if (std::exchange(view_radius_, served) != served) on_view_changed_();
  } else {
    ++bad_requests_;
    ++counters_.refused_requests;
    reply = {{"type", "error"}, {"code", "bad_request"}, {"reason", radius.error()}};
  }
  reply_ = std::make_shared<const std::string>(reply.dump());
  wake_.cancel();
}

void ViewClient::offer_frame(SharedBytes frame) {
  if (std::exchange(frame_, std::move(frame))) ++counters_.frames_skipped;
  wake_.cancel();
}

void ViewClient::offer_status(SharedBytes status) {
  status_ = std::move(status);
  wake_.cancel();
}

void ViewClient::close() {
  open_ = false;
  wake_.cancel();
  beast::get_lowest_layer(stream_).cancel();
}

net::awaitable<void> ViewClient::write_loop() {
  const auto self = shared_from_this();
  while (open_) {
    if (!reply_ && !status_ && !frame_) {
      co_await wake_.async_wait(kNoThrow);
    } else if (!co_await write_one()) {
      close();
    }
  }
}

net::awaitable<bool> ViewClient::write_one() {
  // Small texts go first: a large frame must not starve the state.
  SharedBytes& slot = reply_ ? reply_ : status_ ? status_ : frame_;
  const bool is_frame = &slot == &frame_;
  const SharedBytes message = std::exchange(slot, nullptr);
  stream_.binary(is_frame);
  const auto [error, bytes] = co_await stream_.async_write(net::buffer(*message), kNoThrow);
  if (!error && is_frame) ++counters_.frames_sent;
  co_return !error;
}

}  // namespace ignis
