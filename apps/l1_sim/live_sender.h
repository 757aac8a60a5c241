// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "live_stream.h"
#include "runtime/lcm_link.h"

namespace ignis {

/// Sends frames when their last byte has left the sensor, and listens to the host in between.
class LiveSender {
 public:
  LiveSender(const LiveSensor& sensor, runtime::LcmLink& link) : sensor_(sensor), link_(link) {}

  void send(const sim::StreamFrame& frame);
  /// What is still held when the stream has ended.
  void finish();

  [[nodiscard]] std::int64_t frames_lost() const { return frames_lost_; }
  /// [us] longest time by which something went out too late, because this process did not get the processor.
  [[nodiscard]] Utime latest() const { return latest_; }

 private:
  [[nodiscard]] Utime now() const;  ///< [us] of the stream
  void send(const std::vector<sim::Delivery>& deliveries);
  void wait_until(Utime utime);
  void hear(std::span<const std::byte> bytes);
  void report(const sim::HostCommand& command);
  void warn_of_forbidden();
  void publish_truth(Utime utime);

  LiveSensor sensor_;
  runtime::LcmLink& link_;
  HostLine::Clock::time_point start_steady_ = HostLine::Clock::now();
  Utime start_host_ =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
          .count();
  std::array<std::byte, 512> buffer_{};
  l1::WorkingMode mode_ = l1::WorkingMode::kNormal;
  std::int64_t forbidden_ = 0;
  std::int32_t sequence_ = 0;
  std::int64_t frames_lost_ = 0;
  Utime latest_ = 0;
};

}  // namespace ignis
