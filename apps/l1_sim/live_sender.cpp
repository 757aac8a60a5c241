// SPDX-License-Identifier: Apache-2.0
#include "live_sender.h"

#include <format>
#include <iostream>

#include "messages/odometry_messages.h"
#include "runtime/channels.h"
#include "runtime/stop_signal.h"

namespace ignis {

void LiveSender::send(const sim::StreamFrame& frame) {
  wait_until(frame.end_utime());
  send(sensor_.faults.pass(frame));
  if (frame.message_id == l1::kImuId) publish_truth(frame.measured_utime);
}

void LiveSender::finish() { send(sensor_.faults.finish()); }

Utime LiveSender::now() const {
  return std::chrono::duration_cast<std::chrono::microseconds>(HostLine::Clock::now() - start_steady_).count();
}

void LiveSender::send(const std::vector<sim::Delivery>& deliveries) {
  for (const sim::Delivery& each : deliveries) {
    wait_until(each.utime);
    latest_ = std::max(latest_, now() - each.utime);
    if (!sensor_.line.write(each.bytes)) ++frames_lost_;
  }
}

void LiveSender::wait_until(Utime utime) {
  const auto deadline = start_steady_ + std::chrono::microseconds(utime);
  while (!runtime::stop_requested()) {
    const std::size_t count = sensor_.line.read(buffer_, deadline);
    if (count == 0) break;
    hear(std::span(buffer_).first(count));
  }
}

void LiveSender::hear(std::span<const std::byte> bytes) {
  for (const sim::HostCommand& command : sensor_.listener.feed(bytes)) {
    sensor_.stream.obey(command, now());
    report(command);
  }
  warn_of_forbidden();
}

void LiveSender::report(const sim::HostCommand& command) {
  const double seconds = static_cast<double>(now()) * 1e-6;
  if (const auto* led = std::get_if<sim::LedCommand>(&command)) {
    std::cerr << std::format("l1_sim: {:.3f} s: LED mode {}\n", seconds, led->mode);
  }
  // Hosts repeat themselves; only a change is news.
  if (sensor_.stream.mode() == mode_) return;
  mode_ = sensor_.stream.mode();
  std::cerr << std::format("l1_sim: {:.3f} s: {}\n", seconds,
                           mode_ == l1::WorkingMode::kNormal ? "normal mode" : "standby");
}

void LiveSender::warn_of_forbidden() {
  const std::int64_t forbidden = sensor_.listener.counters().forbidden;
  if (forbidden == forbidden_) return;
  if (forbidden_ == 0) {
    std::cerr << "l1_sim: ERROR: the host sent message 123 or 124, which overwrites a real sensor's calibration\n";
  }
  forbidden_ = forbidden;
}

void LiveSender::publish_truth(Utime utime) {
  const sim::Motion motion = sensor_.stream.truth_at(utime);
  pose_t message = messages::ground_truth_message(start_host_ + utime, motion.T_world_body, motion.v_world);
  message.sequence = sequence_++;
  link_.publish(runtime::channels::kGroundTruth, message);
  const bool whole = frames_lost_ == 0;
  link_.report_health(message.utime, whole ? health_t::OK : health_t::DEGRADED,
                      whole ? "OK" : std::format("{} frames found no reader", frames_lost_));
}

}  // namespace ignis
