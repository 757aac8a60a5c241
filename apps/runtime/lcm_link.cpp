// SPDX-License-Identifier: Apache-2.0
#include "runtime/lcm_link.h"

#include <algorithm>
#include <format>
#include <iostream>
#include <new>
#include <utility>

#include <unistd.h>

#include "runtime/channels.h"
#include "runtime/process_usage.h"
#include "runtime/version.h"

namespace ignis::runtime {
namespace {

constexpr std::chrono::seconds kHealthPeriod{1};
constexpr std::chrono::milliseconds kTextPeriod{200};
constexpr double kSamplePeriod_s = 1.0;
constexpr double kHearingPeriod_s = 0.2;  // of HEALTH with the addresses
constexpr int kHealthQueue = 100;
constexpr int kReceiveBufferLimit = 8'388'608;  // [bytes] that the package sets and the doctor asks for
constexpr char kSocketName[] = "UDP";           // in HEALTH, for what the kernel dropped before any channel was known

Utime system_utime() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// What mends a bus that cannot be reached.
std::string remedy(const std::string& url) {
  if (!url.starts_with("udpm://")) return {};
  return " If multicast has no route, run: sudo ip link set lo up multicast on && sudo ip route add 224.0.0.0/4 dev lo";
}

}  // namespace

LcmLink::LcmLink(const Application& application)
    : identity_{.process = application.name,
                .pid = getpid(),
                .version = build(),
                .config_hash = application.config_hash},
      url_(application.config.lcm.url),
      alone_(application.name, url_),
      lcm_(url_),
      address_(BusAddress::parse(url_)),
      budget_(application.config.health.limits_of(application.name)),
      peers_(identity_) {
  if (!lcm_.good()) throw UserError(std::format("cannot open the message bus {}.{}", url_, remedy(url_)), kFailed);
}

void LcmLink::subscribe_raw(Receiver& receiver, int queue_capacity) {
  lcm::Subscription* subscription = lcm_.subscribeFunction(receiver.counts.channel, &LcmLink::on_message, &receiver);
  if (subscription == nullptr) throw UserError(std::format("cannot subscribe to {}", receiver.counts.channel), kFailed);
  subscription->setQueueCapacity(queue_capacity);
  receiver.link = this;
  receiver.subscription = subscription;
  // LCM opens its socket at the first subscription.
  if (address_ && !socket_) guard_socket();
}

void LcmLink::guard_socket() {
  socket_ = BusSocket::guard(*address_);
  if (!socket_) return;
  shortage_ = address_->shortage(socket_->receive_buffer());
  if (shortage_.empty()) return;
  std::cerr << std::format("{}: {}; sudo sysctl -w net.core.rmem_max={}\n", identity_.process, shortage_,
                           std::max(kReceiveBufferLimit, address_->receive_buffer));
}

void LcmLink::on_message(const lcm::ReceiveBuffer* buffer, const std::string&, Receiver* receiver) {
  LcmLink& link = *receiver->link;
  // A datagram without a channel terminator reaches the handler with a negative size.
  if (buffer->data == nullptr || static_cast<std::int32_t>(buffer->data_size) < 0) {
    link.refuse(*receiver, "a datagram without a body", false);
    return;
  }
  receiver->counts.waiting = receiver->subscription->getQueueSize();
  link.take({static_cast<const std::byte*>(buffer->data), buffer->data_size}, *receiver);
  // LCM's receiving thread stamps with the system's clock, so this compares with it.
  link.budget_.add_latency(1e-3 * static_cast<double>(system_utime() - buffer->recv_utime));
}

void LcmLink::take(std::span<const std::byte> data, Receiver& receiver) {
  std::string problem;
  try {
    problem = receiver.deliver(data);
    if (problem.empty()) {
      receiver.refusals.taken(uptime_s());
      return;
    }
  } catch (...) {
    // What a handler cannot live with ends the process, but not from within LCM.
    failure_ = std::current_exception();
    return;
  }
  const std::string foreign = Refusals::foreign_type(data, receiver.type);
  refuse(receiver, foreign.empty() ? problem : foreign, !foreign.empty());
}

void LcmLink::refuse(Receiver& receiver, const std::string& reason, bool is_foreign) {
  ++receiver.counts.rejected;
  if (!receiver.refusals.refused(reason, is_foreign, uptime_s())) return;
  std::cerr << std::format("{}: {}: message {} refused: {}\n", identity_.process, receiver.counts.channel,
                           receiver.refusals.count(), reason);
}

bool LcmLink::handle(int timeout_ms) {
  const int handled = lcm_.handleTimeout(timeout_ms);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  if (handled >= 0) got_on();
  return handled > 0;
}

void LcmLink::got_on() { supervisor_.feed(++progress_, uptime_s()); }

double LcmLink::uptime_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
}

/// Not in the constructor: a process that only publishes and never reports has no use for it.
void LcmLink::watch_peers() {
  if (std::exchange(watching_peers_, true)) return;
  subscribe<health_t>(
      channels::kHealth, kHealthQueue,
      [this](const health_t& message) {
        if (!PeerWatch::is_possible(message.uptime_s)) return "its uptime is impossible";
        // Those that come over UDP are heard with their addresses.
        if (!addresses_) observe_peer(message, {});
        return "";
      },
      Senders::kSeveral);
  // After the subscription: BusSocket takes every socket on the bus's port for LCM's.
  if (address_) addresses_.emplace(*address_);
}

void LcmLink::observe_peer(const health_t& message, const UdpAddress& sender) {
  const bool is_ours = message.process == identity_.process && message.pid == identity_.pid &&
                       std::ranges::contains(own_uptimes_s_, message.uptime_s);
  if (is_ours) return;
  peers_.observe({.process = message.process,
                  .pid = message.pid,
                  .version = message.version,
                  .config_hash = message.config_hash,
                  .sender = sender},
                 uptime_s(), message.uptime_s);
}

void LcmLink::hear_peers() {
  const double now = uptime_s();
  if (!addresses_ || now - last_hearing_s_ < kHearingPeriod_s) return;
  last_hearing_s_ = now;
  addresses_->hear([this](const health_t& message, const UdpAddress& sender) { observe_peer(message, sender); });
}

/// Two senders of one channel are one stream of nonsense; what the later one says is not even received.
void LcmLink::ignore_latecomers() {
  const double now = uptime_s();
  if (!addresses_ || !socket_ || now - last_look_s_ < kSamplePeriod_s) return;
  last_look_s_ = now;
  ignored_.clear();
  std::vector<UdpAddress> unheard;
  for (const PeerIdentity& late : peers_.latecomers(now)) {
    if (addresses_->speaks_for_others(late.sender, late.process)) continue;
    ignored_.push_back(late);
    unheard.push_back(late.sender);
  }
  socket_->ignore(unheard);
}

void LcmLink::sample_budget() {
  const double now = uptime_s();
  if (last_sample_s_ >= 0.0 && now - last_sample_s_ < kSamplePeriod_s) return;
  last_sample_s_ = now;
  budget_.sample(now, process_usage());
}

std::string LcmLink::own_trouble() const {
  std::string text = peers_.trouble(uptime_s());
  const auto add = [&text](const std::string& more) {
    if (!text.empty() && !more.empty()) text += "; ";
    text += more;
  };
  for (const PeerIdentity& late : ignored_) {
    add(std::format("{} {} came later and is not listened to", late.process, late.pid));
  }
  add(sends_.trouble(uptime_s()));
  add(budget_.trouble());
  for (const Receiver& receiver : receivers_) {
    const std::string refusal = receiver.refusals.trouble(uptime_s());
    if (!refusal.empty()) add(std::format("{}: {}", receiver.counts.channel, refusal));
  }
  return text;
}

std::int8_t LcmLink::own_state() const {
  const auto taken = [this](const Receiver& receiver) { return receiver.refusals.is_taken_by_another(uptime_s()); };
  const bool fault = sends_.is_mute() || peers_.needs_person(uptime_s()) || std::ranges::any_of(receivers_, taken);
  return fault ? health_t::FAULT : health_t::DEGRADED;
}

void LcmLink::report_health(Utime utime, std::int8_t state, const std::string& state_text, std::int32_t resets) {
  watch_peers();
  hear_peers();
  ignore_latecomers();
  sample_budget();
  sends_.look(failed_sends_, uptime_s());
  supervisor_.turn(progress_, uptime_s());

  health_t message{};
  message.state = state;
  message.state_text = state_text;
  if (const std::string trouble = own_trouble(); !trouble.empty()) {
    message.state = std::max(state, own_state());
    message.state_text = state == health_t::OK ? trouble : std::format("{}; {}", state_text, trouble);
  }
  // No trouble as long as nothing is lost, and that is counted by channel.
  if (!shortage_.empty()) message.state_text += (message.state_text.empty() ? "" : "; ") + shortage_;
  const auto now = std::chrono::steady_clock::now();
  // A text may hold figures that change all the time. A bus that takes nothing is tried often, to be back early.
  const bool is_calm = message.state_text == last_state_text_ && !sends_.is_mute();
  const bool due = now - last_health_ >= (is_calm ? kHealthPeriod : kTextPeriod);
  if (!due && message.state == last_state_) return;
  if (message.state_text != last_state_text_) supervisor_.status(message.state_text);
  last_health_ = now;
  last_state_ = message.state;
  last_state_text_ = message.state_text;
  message.utime = utime;
  message.sequence = health_sequence_++;
  message.resets = resets;
  publish_health(message);
}

void LcmLink::publish_health(health_t& message) {
  message.process = identity_.process;
  message.pid = identity_.pid;
  message.version = identity_.version;
  message.config_hash = identity_.config_hash;
  message.uptime_s = uptime_s();
  own_uptimes_s_[static_cast<std::size_t>(message.sequence) % own_uptimes_s_.size()] = message.uptime_s;
  message.progress = progress_;
  message.failed_sends = failed_sends_;
  message.cpu_percent = budget_.cpu_percent();
  message.memory_mb = budget_.memory_mb();
  message.latency_ms = budget_.latency_ms();
  const ProcessLimits limits = budget_.limits().value_or(ProcessLimits{});
  message.cpu_limit_percent = limits.cpu_percent;
  message.memory_limit_mb = limits.memory_mb;
  message.latency_limit_ms = limits.latency_ms;
  const auto list = [&message](const ReceiverCounts& counts) {
    ++message.num_receivers;
    message.channels.push_back(counts.channel);
    message.received.push_back(counts.received);
    message.lost.push_back(counts.lost);
    message.rejected.push_back(counts.rejected);
    message.queue_drops.push_back(counts.queue_drops);
  };
  for (const Receiver& receiver : receivers_) list(receiver.counts);
  if (socket_) list({.channel = kSocketName, .rejected = socket_->dropped()});
  const bool sent = publish(channels::kHealth, message);
  sends_.look(failed_sends_, message.uptime_s);
  if (const std::string news = sends_.health_sent(sent, message.uptime_s); !news.empty()) {
    const std::string advice = sent ? "" : std::format(" {}.{}", url_, remedy(url_));
    std::cerr << std::format("{}: {}{}\n", identity_.process, news, advice);
  }
}

}  // namespace ignis::runtime
