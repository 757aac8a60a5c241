// SPDX-License-Identifier: Apache-2.0
#include "runtime/lcm_link.h"

#include <format>

#include <unistd.h>

namespace ignis::runtime {
namespace {

constexpr std::chrono::seconds kHealthPeriod{1};
constexpr std::chrono::milliseconds kTextPeriod{200};

std::string cannot_open(const std::string& url) {
  std::string text = std::format("cannot open the message bus {}.", url);
  if (url.starts_with("udpm://")) {
    text +=
        " If multicast has no route, run: sudo ip link set lo up multicast on && sudo ip route add 224.0.0.0/4 dev lo";
  }
  return text;
}

}  // namespace

LcmLink::LcmLink(const Application& application)
    : process_(application.name), config_hash_(application.config_hash), lcm_(application.config.lcm.url) {
  if (!lcm_.good()) throw UserError(cannot_open(application.config.lcm.url), kFailed);
}

void LcmLink::subscribe_raw(Receiver& receiver, int queue_capacity) {
  lcm::Subscription* subscription = lcm_.subscribeFunction(receiver.counts.channel, &LcmLink::on_message, &receiver);
  if (subscription == nullptr) throw UserError(std::format("cannot subscribe to {}", receiver.counts.channel), kFailed);
  subscription->setQueueCapacity(queue_capacity);
}

void LcmLink::on_message(const lcm::ReceiveBuffer* buffer, const std::string&, Receiver* receiver) {
  // A datagram without a channel terminator reaches the handler with a negative size.
  if (buffer->data == nullptr || static_cast<std::int32_t>(buffer->data_size) < 0) {
    ++receiver->counts.rejected;
    return;
  }
  receiver->deliver({static_cast<const std::byte*>(buffer->data), buffer->data_size});
}

bool LcmLink::handle(int timeout_ms) { return lcm_.handleTimeout(timeout_ms) > 0; }

void LcmLink::report_health(Utime utime, std::int8_t state, const std::string& state_text, std::int32_t resets) {
  const auto now = std::chrono::steady_clock::now();
  // A text may hold figures that change all the time.
  const bool due = now - last_health_ >= (state_text == last_state_text_ ? kHealthPeriod : kTextPeriod);
  if (!due && state == last_state_) return;
  last_health_ = now;
  last_state_ = state;
  last_state_text_ = state_text;
  health_t message;
  message.utime = utime;
  message.sequence = health_sequence_++;
  message.process = process_;
  message.pid = getpid();
  message.state = state;
  message.state_text = state_text;
  message.resets = resets;
  message.version = version();
  message.config_hash = config_hash_;
  message.uptime_s = std::chrono::duration<double>(now - started_).count();
  message.num_receivers = static_cast<std::int32_t>(receivers_.size());
  for (const Receiver& receiver : receivers_) {
    message.channels.push_back(receiver.counts.channel);
    message.received.push_back(receiver.counts.received);
    message.lost.push_back(receiver.counts.lost);
    message.rejected.push_back(receiver.counts.rejected);
    message.queue_drops.push_back(receiver.counts.queue_drops);
  }
  publish("HEALTH", message);
}

}  // namespace ignis::runtime
