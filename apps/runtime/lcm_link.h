// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <lcm/lcm-cpp.hpp>

#include "messages/length_check.h"
#include "messages/part_assembler.h"
#include "runtime/application.h"
#include "runtime/budget_watch.h"
#include "runtime/bus_socket.h"
#include "runtime/instance_lock.h"
#include "runtime/peer_watch.h"
#include "runtime/refusals.h"
#include "runtime/send_watch.h"
#include "runtime/sender_addresses.h"
#include "runtime/sequence_tracker.h"
#include "runtime/service_notifier.h"

namespace ignis::runtime {

/// What one subscription received and lost. Published in health_t.
struct ReceiverCounts {
  std::string channel;
  std::int64_t received = 0;
  std::int64_t fresh = 0;        ///< of them those that are no repeats, late, or further parts; of one sender
  std::int64_t lost = 0;         ///< by the sender's running number, and scans or keyframes with a part missing
  std::int64_t rejected = 0;     ///< wrong type, or a length that contradicts the counts inside
  std::int64_t queue_drops = 0;  ///< skipped by this process because it was late
  std::int64_t waiting = 0;      ///< messages of the channel behind the one at hand; for handlers
};

/// Whether the running numbers of a channel can be checked: several senders share HEALTH, requests and commands.
enum class Senders : std::uint8_t { kOne, kSeveral };

/// A process's end of the bus: checked opening, subscriptions with their own queue capacity, length checks before any
/// decoder, loss counters, and HEALTH. One thread calls handle(); handlers run inside it. publish() may be called from
/// any thread.
class LcmLink {
 public:
  /// Opens the bus. Throws UserError that says what to do (no multicast route, bad URL, a second instance).
  explicit LcmLink(const Application& application);

  /// False when the message could not be sent; that is counted, and HEALTH tells it.
  template <class Message>
  bool publish(const std::string& channel, const Message& message) {
    const bool sent = lcm_.publish(channel, &message) == 0;
    if (!sent) ++failed_sends_;
    return sent;
  }

  /// Calls `handler` with each well-formed message. It may return why it refuses one, for HEALTH and the log: a string
  /// literal, empty when it does not. The counts stay valid as long as the link.
  template <class Message, class Handler>
  ReceiverCounts& subscribe(const std::string& channel, int queue_capacity, Handler handler,
                            Senders senders = Senders::kOne) {
    Receiver& receiver = receivers_.emplace_back();
    receiver.counts.channel = channel;
    receiver.type = Message::getHash();
    receiver.deliver = [&receiver, handler = std::move(handler),
                        senders](std::span<const std::byte> data) -> const char* {
      Message message;
      if (!messages::decode_checked(data, message)) return "its length or its stamp is impossible";
      if constexpr (requires { message.part_count; }) {
        if (!messages::numbering_is_possible(message)) return "its part number or its number of parts is impossible";
      }
      ++receiver.counts.received;
      if (senders == Senders::kOne) {
        receiver.counts.lost += receiver.sequence.observe(message.sequence, message.utime);
        receiver.counts.fresh = receiver.sequence.fresh();
      }
      if constexpr (std::is_void_v<std::invoke_result_t<const Handler&, const Message&>>) {
        handler(message);
        return "";
      } else {
        return handler(message);
      }
    };
    subscribe_raw(receiver, queue_capacity);
    return receiver.counts;
  }

  /// Waits at most `timeout_ms` for one message and handles it. True when one was handled. Returning from it without an
  /// error is progress: everything that had arrived so far has been handled.
  bool handle(int timeout_ms);

  /// For a handler that may work longer than the watchdog waits: call it on the same thread whenever a part of its work
  /// is done, and never where none is.
  void got_on();

  /// For work that does not come over the bus, such as bytes of a serial line: it was done `latency_ms` after its input
  /// had arrived.
  void add_latency(double latency_ms) { budget_.add_latency(latency_ms); }

  /// Publishes HEALTH when a second has passed, at once when `state` changed, and for a new text, or while nothing can
  /// be sent, every 200 ms. `utime`: newest measurement seen [us]. `state`: one of health_t's constants; OK becomes
  /// DEGRADED, with the reason, when this process exceeds its limits, and FAULT when the processes on the bus do not
  /// belong together (PeerWatch) or nothing can be sent to it (SendWatch).
  /// Call it again and again: at the first time the supervisor hears that the process is ready.
  void report_health(Utime utime, std::int8_t state, const std::string& state_text, std::int32_t resets = 0);

  [[nodiscard]] std::int64_t failed_sends() const { return failed_sends_; }

 private:
  struct Receiver {
    ReceiverCounts counts;
    SequenceTracker sequence;
    Refusals refusals;
    std::int64_t type = 0;                                           ///< fingerprint of the messages that belong here
    std::function<const char*(std::span<const std::byte>)> deliver;  ///< why it was refused; empty when it was not
    LcmLink* link = nullptr;
    lcm::Subscription* subscription = nullptr;
  };

  void subscribe_raw(Receiver& receiver, int queue_capacity);
  void guard_socket();
  static void on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel, Receiver* receiver);
  void take(std::span<const std::byte> data, Receiver& receiver);
  void refuse(Receiver& receiver, const std::string& reason, bool is_foreign);
  void watch_peers();
  void observe_peer(const health_t& message, const UdpAddress& sender);
  void hear_peers();
  void ignore_latecomers();
  void sample_budget();
  void publish_health(health_t& message);
  [[nodiscard]] std::string own_trouble() const;
  [[nodiscard]] std::int8_t own_state() const;
  [[nodiscard]] double uptime_s() const;

  PeerIdentity identity_;
  std::string url_;
  InstanceLock alone_;
  lcm::LCM lcm_;
  std::deque<Receiver> receivers_;  // a deque keeps addresses stable
  std::optional<BusAddress> address_;
  std::optional<BusSocket> socket_;
  std::string shortage_;        // of the socket's buffer; empty when it has what was asked for
  std::exception_ptr failure_;  // of a handler; LCM's C code must not see it
  std::atomic<std::int64_t> failed_sends_ = 0;
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point last_health_{};
  std::int8_t last_state_ = -1;
  std::string last_state_text_;
  std::int32_t health_sequence_ = 0;
  BudgetWatch budget_;
  PeerWatch peers_;
  SendWatch sends_;
  bool watching_peers_ = false;
  std::optional<SenderAddresses> addresses_;
  std::vector<PeerIdentity> ignored_;
  std::array<double, 256> own_uptimes_s_{};  // in our newest HEALTH messages: by them we know our own
  double last_hearing_s_ = -1.0;
  double last_look_s_ = -1.0;
  double last_sample_s_ = -1.0;
  std::int64_t progress_ = 0;
  ServiceNotifier supervisor_;
};

}  // namespace ignis::runtime
