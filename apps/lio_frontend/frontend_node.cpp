// SPDX-License-Identifier: Apache-2.0
#include "frontend_node.h"

#include <algorithm>
#include <chrono>
#include <format>
#include <iostream>
#include <set>

#include "frontend/checkpoint.h"
#include "runtime/channels.h"

namespace ignis {
namespace {

namespace channels = runtime::channels;

constexpr int kPollMs = 100;
constexpr int kRequestQueue = 100;
// In one answer, so that the live flow goes on: of the clouds that a map asks for at a time, and of their keyframes.
constexpr std::size_t kMostResentParts = 36;
constexpr double kSilence_s = 1.0;            // of both streams, of this computer's time
constexpr Utime kCheckpointPeriod = 400'000;  // [us]

/// Calls `work` and returns its result with the wall time it took [ms].
template <class Work>
auto timed(Work&& work) {
  const auto began = std::chrono::steady_clock::now();
  auto result = work();
  const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - began;
  return std::pair(std::move(result), spent.count());
}

}  // namespace

FrontendNode::FrontendNode(const runtime::Application& application, const std::filesystem::path& checkpoint_folder)
    : config_(application.config),
      config_hash_(application.config_hash),
      link_(application),
      lio_(config_.frontend.filter),
      backlog_(config_.lcm.scan_backlog_s) {
  if (!checkpoint_folder.empty()) {
    checkpoints_ = std::make_unique<CheckpointFolder>(checkpoint_folder);
    resume();
  }
  imu_counts_ = &link_.subscribe<imu_t>(channels::kImu, config_.lcm.imu_queue,
                                        [this](const imu_t& message) { return on_imu(message); });
  scan_counts_ = &link_.subscribe<messages::ScanPart>(channels::kScan, config_.lcm.scan_queue,
                                                      [this](const messages::ScanPart& part) { on_scan_part(part); });
  request_counts_ = &link_.subscribe<keyframe_request_t>(
      channels::kKeyframeRequest, kRequestQueue, [this](const keyframe_request_t& request) { on_request(request); },
      runtime::Senders::kSeveral);
  cloud_request_counts_ = &link_.subscribe<keyframe_request_t>(
      channels::kCloudRequest, kRequestQueue, [this](const keyframe_request_t& request) { on_cloud_request(request); },
      runtime::Senders::kSeveral);
  link_.subscribe<lio_command_t>(
      channels::kLioCommand, kRequestQueue,
      [this](const lio_command_t& command) { return messages::carry_out(command, lio_); }, runtime::Senders::kSeveral);
}

void FrontendNode::resume() {
  lio_ = start_from_checkpoint(config_.frontend.filter, config_hash_, checkpoints_->load());
  for (const Keyframe& keyframe : checkpoints_->load_keyframes(lio_.session())) sent_keyframes_.add(keyframe);
  kept_session_ = lio_.session();
}

/// Before anybody hears of a keyframe it is safe, and so is that its id is used: a successor neither reuses the id nor
/// leaves a hole.
void FrontendNode::keep(std::span<const ScanResult> scans) {
  if (!checkpoints_ || scans.empty() || !lio_.can_be_resumed()) return;
  const auto has_keyframe = [](const ScanResult& scan) { return scan.keyframe.has_value(); };
  const bool due = scans.back().stats.utime - last_checkpoint_ >= kCheckpointPeriod;
  if (!due && std::ranges::none_of(scans, has_keyframe)) return;
  for (const ScanResult& scan : scans) {
    if (scan.keyframe) checkpoints_->save_keyframe(*scan.keyframe);
  }
  checkpoints_->save(encode_checkpoint(lio_, config_hash_));
  kept_session_ = lio_.session();
  last_checkpoint_ = scans.back().stats.utime;
}

/// Until the next one has started there is nothing to go on from, and its number must not be given out twice.
void FrontendNode::keep_end_of_session() {
  if (!checkpoints_ || lio_.session() == kept_session_ || lio_.can_be_resumed()) return;
  checkpoints_->save(encode_ended_session(lio_.session(), config_hash_));
  kept_session_ = lio_.session();
}

void FrontendNode::spin_once() {
  link_.handle(kPollMs);
  publish_health();
}

const char* FrontendNode::on_imu(const imu_t& message) {
  const auto [result, milliseconds] = timed([&] { return lio_.add_imu(messages::from_message(message)); });
  if (result.fault == ImuFault::kDuplicate) {
    ++imu_counts_->rejected;  // nothing is lost by what a network doubles
    return "";
  }
  if (result.fault != ImuFault::kNone) return text(result.fault);
  newest_utime_ = message.utime;
  data_heard_ = std::chrono::steady_clock::now();
  publish(result.scans, milliseconds);
  keep_end_of_session();
  if (!result.state) return "";
  const std::optional<Matrix15d> owed = order_.take_sample(lio_.session(), result.state->utime);
  publish_state(*result.state, lio_.session(), owed ? &*owed : nullptr);
  return "";
}

void FrontendNode::on_scan_part(const messages::ScanPart& part) {
  data_heard_ = std::chrono::steady_clock::now();
  const auto kept = std::make_shared<const std::vector<std::byte>>(part.data.begin(), part.data.end());
  const std::optional<messages::EncodedScan> scan = assembler_.add(*kept, kept);
  if (scan) on_scan(*scan, static_cast<double>(scan_counts_->waiting) / part.part_count);
  scan_counts_->queue_drops = assembler_.incomplete() + backlog_.left_out();
}

/// Points are read of those scans only that are used: a computer that is behind has no time for the others.
void FrontendNode::on_scan(const messages::EncodedScan& scan, double scans_waiting) {
  ++scans_heard_;
  const Scan frame = scan.read_frame();
  if (backlog_.leaves_out(frame, scans_waiting)) {
    publish_scan(lio_.refuse(frame, ScanReason::kBehind), 0.0);
    return;
  }
  const auto [results, milliseconds] = timed([&] { return lio_.add_scan(scan.read()); });
  publish(results, milliseconds);
}

void FrontendNode::publish(std::span<const ScanResult> scans, double milliseconds) {
  keep(scans);
  for (const ScanResult& scan : scans) publish_scan(scan, milliseconds);
}

void FrontendNode::publish_state(const NavState& state, std::int32_t session, const Matrix15d* covariance) {
  state_t message = messages::to_message(state, session, "odom", covariance);
  message.sequence = state_sequence_++;
  link_.publish(channels::kState, message);
}

void FrontendNode::publish_scan(const ScanResult& scan, double milliseconds) {
  scan_stats_t stats = messages::to_message(scan.stats);
  stats.sequence = scan_sequence_++;
  stats.time_spent_ms = milliseconds;
  link_.publish(channels::kScanStats, stats);
  if (!scan.has_state) return;
  const std::int32_t session = scan.stats.session;
  if (order_.take_scan(session, scan.state.utime, scan.covariance)) {
    publish_state(scan.state, session, &scan.covariance);
  }
  publish_cloud(scan);
  if (scan.keyframe) {
    sent_clouds_.note_keyframe(scan.keyframe->id);
    publish_keyframe(*scan.keyframe);
  }
}

void FrontendNode::publish_cloud(const ScanResult& scan) {
  messages::PosedCloud cloud{.utime = scan.state.utime,
                             .sequence = cloud_sequence_++,
                             .session = scan.stats.session,
                             .applied = scan.stats.applied(),
                             .T_odom_body = scan.state.T_odom_body,
                             .points = scan.cloud};
  for (const cloud_t& part : sent_clouds_.add(cloud)) link_.publish(channels::kCloud, part);
}

void FrontendNode::publish_keyframe(const Keyframe& keyframe) {
  for (const keyframe_t& part : sent_keyframes_.add(keyframe)) link_.publish(channels::kKeyframe, part);
}

void FrontendNode::on_request(const keyframe_request_t& request) {
  const std::set<std::int32_t> wanted(request.ids.begin(), request.ids.end());
  for (const std::int32_t id : wanted) {
    if (!resend_keyframe(request.session, id)) {
      ++request_counts_->rejected;
      return;
    }
  }
}

/// The number of parts, none when the keyframe is not there; nothing when too many were asked for lately.
std::optional<std::size_t> FrontendNode::resend_keyframe(std::int32_t session, std::int32_t id) {
  const std::vector<keyframe_t>* parts = sent_keyframes_.find(session, id);
  if (parts == nullptr) return 0;
  if (!resends_.allow(std::chrono::steady_clock::now())) return std::nullopt;
  for (const keyframe_t& part : *parts) link_.publish(channels::kKeyframe, part);
  return parts->size();
}

/// On a channel of their own: whoever follows LIO_CLOUD has had them. A keyframe goes first, so that who has a cloud
/// has the keyframe that was made of it.
void FrontendNode::on_cloud_request(const keyframe_request_t& request) {
  if (!cloud_resends_.allow(std::chrono::steady_clock::now())) {
    ++cloud_request_counts_->rejected;
    return;
  }
  std::set<std::int32_t> answered;
  std::size_t parts = 0;
  for (const std::int32_t number : request.ids) {
    const SentClouds::Sent* sent = sent_clouds_.find(request.session, number);
    if (sent == nullptr || !answered.insert(number).second) continue;
    const std::optional<std::size_t> keyframe_parts =
        sent->keyframe ? resend_keyframe(request.session, *sent->keyframe) : 0;
    if (!keyframe_parts) {
      ++cloud_request_counts_->rejected;
      return;
    }
    for (const cloud_t& part : sent->parts) link_.publish(channels::kCloudAgain, part);
    parts += sent->parts.size() + *keyframe_parts;
    if (parts >= kMostResentParts) return;
  }
}

/// Lio's clock is the sensor's: it does not hear that neither samples nor scans come any more.
void FrontendNode::tell_silence(LioStatus& status) const {
  const std::chrono::duration<double> silence = std::chrono::steady_clock::now() - data_heard_;
  if (!status.running || silence.count() < kSilence_s) return;
  const std::string known = status.trust == Trust::kOk ? "" : "; " + status.reason;
  status.trust = std::max(status.trust, Trust::kDegraded);
  status.reason = std::format("no sensor data for {:.0f} s, the pose stands still{}", silence.count(), known);
}

/// A filter that bridges every gap is content; whoever drives must know that half of the margin is gone.
void FrontendNode::tell_losses(LioStatus& status) {
  const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  imu_losses_.look(now_s, imu_counts_->fresh, imu_counts_->lost);
  scan_losses_.look(now_s, scans_heard_, scan_counts_->lost + assembler_.incomplete());
  const std::string haste = backlog_.is_behind() ? "scans are left out, more come than this computer has time for" : "";
  for (const std::string& trouble : {imu_losses_.trouble(), scan_losses_.trouble(), haste}) {
    if (trouble.empty()) continue;
    status.reason = status.trust == Trust::kOk ? trouble : status.reason + "; " + trouble;
    status.trust = std::max(status.trust, Trust::kDegraded);
  }
}

void FrontendNode::publish_health() {
  if (lio_.start_note() != told_note_) {
    told_note_ = lio_.start_note();
    std::cerr << "lio_frontend: " << told_note_ << std::endl;
  }
  LioStatus status = lio_.status();
  tell_silence(status);
  tell_losses(status);
  if (checkpoints_ && !checkpoints_->failure().empty()) {
    status.trust = std::max(status.trust, Trust::kDegraded);
    status.reason += "; " + checkpoints_->failure();
  }
  static_assert(static_cast<int>(Trust::kOk) == health_t::OK &&
                static_cast<int>(Trust::kDegraded) == health_t::DEGRADED &&
                static_cast<int>(Trust::kLost) == health_t::LOST);
  link_.report_health(newest_utime_, static_cast<std::int8_t>(status.trust), status.reason, lio_.session());
}

}  // namespace ignis
