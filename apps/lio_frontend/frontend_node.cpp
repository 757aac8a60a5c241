// SPDX-License-Identifier: Apache-2.0
#include "frontend_node.h"

#include <algorithm>
#include <chrono>
#include <format>

#include "runtime/channels.h"

namespace ignis {
namespace {

namespace channels = runtime::channels;

constexpr int kPollMs = 100;
constexpr std::size_t kKeyframesKept = 400;
constexpr int kKeyframeRequestQueue = 100;

/// Calls `work` and returns its result with the wall time it took [ms].
template <class Work>
auto timed(Work&& work) {
  const auto began = std::chrono::steady_clock::now();
  auto result = work();
  const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - began;
  return std::pair(std::move(result), spent.count());
}

}  // namespace

FrontendNode::FrontendNode(const runtime::Application& application)
    : config_(application.config), link_(application), lio_(config_.frontend.filter) {
  imu_counts_ =
      &link_.subscribe<imu_t>(channels::kImu, config_.lcm.imu_queue, [this](const imu_t& message) { on_imu(message); });
  scan_counts_ = &link_.subscribe<scan_t>(channels::kScan, config_.lcm.scan_queue,
                                          [this](const scan_t& part) { on_scan_part(part); });
  request_counts_ = &link_.subscribe<keyframe_request_t>(
      channels::kKeyframeRequest, kKeyframeRequestQueue,
      [this](const keyframe_request_t& request) { on_request(request); }, runtime::Senders::kSeveral);
}

void FrontendNode::spin_once() {
  link_.handle(kPollMs);
  publish_health();
}

void FrontendNode::on_imu(const imu_t& message) {
  const auto [result, milliseconds] = timed([&] { return lio_.add_imu(messages::from_message(message)); });
  if (result.fault == ImuFault::kNone) {
    newest_utime_ = message.utime;
  } else {
    ++imu_counts_->rejected;
  }
  for (const ScanResult& scan : result.scans) publish_scan(scan, milliseconds);
  if (result.state) publish_state(*result.state, nullptr);
}

void FrontendNode::on_scan_part(const scan_t& part) {
  std::optional<Scan> scan = assembler_.add(part);
  scan_counts_->queue_drops = assembler_.incomplete();
  if (!scan) return;
  const auto [results, milliseconds] = timed([&] { return lio_.add_scan(std::move(*scan)); });
  for (const ScanResult& result : results) publish_scan(result, milliseconds);
}

void FrontendNode::publish_state(const NavState& state, const Matrix15d* covariance) {
  state_t message = messages::to_message(state, lio_.session(), "odom", covariance);
  message.sequence = state_sequence_++;
  link_.publish(channels::kState, message);
}

void FrontendNode::publish_scan(const ScanResult& scan, double milliseconds) {
  scan_stats_t stats = messages::to_message(scan.stats);
  stats.sequence = scan_sequence_++;
  stats.time_spent_ms = milliseconds;
  link_.publish(channels::kScanStats, stats);
  if (!scan.has_state) return;
  publish_state(scan.state, &scan.covariance);
  messages::PosedCloud cloud{.utime = scan.state.utime,
                             .sequence = cloud_sequence_++,
                             .session = lio_.session(),
                             .applied = scan.stats.applied(),
                             .T_odom_body = scan.state.T_odom_body,
                             .points = scan.cloud};
  for (const cloud_t& part : messages::to_messages(cloud)) link_.publish(channels::kCloud, part);
  if (scan.keyframe) publish_keyframe(*scan.keyframe);
}

void FrontendNode::publish_keyframe(const Keyframe& keyframe) {
  for (const keyframe_t& part : messages::to_messages(keyframe)) link_.publish(channels::kKeyframe, part);
  sent_keyframes_.push_back(keyframe);
  if (sent_keyframes_.size() > kKeyframesKept) sent_keyframes_.pop_front();
}

void FrontendNode::on_request(const keyframe_request_t& request) {
  for (const Keyframe& keyframe : sent_keyframes_) {
    if (keyframe.session != request.session || std::ranges::find(request.ids, keyframe.id) == request.ids.end())
      continue;
    if (!resends_.allow(std::chrono::steady_clock::now())) {
      ++request_counts_->rejected;
      return;
    }
    for (const keyframe_t& part : messages::to_messages(keyframe)) link_.publish(channels::kKeyframe, part);
  }
}

void FrontendNode::publish_health() {
  const LioStatus status = lio_.status();
  static_assert(static_cast<int>(Trust::kOk) == health_t::OK &&
                static_cast<int>(Trust::kDegraded) == health_t::DEGRADED &&
                static_cast<int>(Trust::kLost) == health_t::LOST);
  link_.report_health(newest_utime_, static_cast<std::int8_t>(status.trust), status.reason, lio_.session());
}

}  // namespace ignis
