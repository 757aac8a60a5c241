// SPDX-License-Identifier: Apache-2.0
#include "runtime/send_watch.h"

#include <format>

namespace ignis::runtime {

void SendWatch::look(std::int64_t failed_sends, double now_s) {
  if (failed_sends > failed_sends_) {
    last_failed_s_ = now_s;
    return_.clear();
  }
  failed_sends_ = failed_sends;
}

std::string SendWatch::health_sent(bool sent, double now_s) {
  if (sent == !is_mute()) return {};
  if (!sent) {
    mute_since_s_ = now_s;
    return trouble(now_s);
  }
  return_ = std::format("nothing could be sent to the bus for {:.1f} s: {} messages so far", now_s - *mute_since_s_,
                        failed_sends_);
  mute_since_s_.reset();
  return return_;
}

std::string SendWatch::trouble(double now_s) const {
  if (is_mute()) return "nothing can be sent to the bus";
  if (failed_sends_ == 0 || now_s - last_failed_s_ > kTold_s) return {};
  return return_.empty() ? std::format("{} messages could not be sent so far", failed_sends_) : return_;
}

}  // namespace ignis::runtime
