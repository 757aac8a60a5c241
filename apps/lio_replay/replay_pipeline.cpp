// SPDX-License-Identifier: Apache-2.0
#include "replay_pipeline.h"

#include <utility>

#include "messages/lio_command.h"

namespace ignis {
namespace {

/// Scans that the front end may be ahead: a loop's search takes as long as a hundred scans of an L1, and 128 thinned
/// scans of the largest LiDAR are some 40 MB.
constexpr std::size_t kMostAhead = 128;

}  // namespace

ReplayPipeline::ReplayPipeline(const runtime::IgnisConfig& config, bool use_loops, GraphListener* listener,
                               std::int32_t session)
    : lio_(config.frontend.filter, session), follower_(config, use_loops, listener, session), steps_(kMostAhead) {
  following_ = std::thread([this] { follow(); });
}

ReplayPipeline::~ReplayPipeline() { end_following(); }

void ReplayPipeline::add_imu(const ImuSample& sample) {
  ImuResult imu = frontend_timer_.time([&] { return lio_.add_imu(sample); });
  ++imu_samples_;
  if (imu.fault != ImuFault::kNone) ++rejected_imu_[std::string(text(imu.fault))];
  for (ScanResult& scan : imu.scans) hand_over(std::move(scan), frontend_timer_.newest_ms());
}

void ReplayPipeline::add_scan(Scan scan) {
  std::vector<ScanResult> scans = frontend_timer_.time([&] { return lio_.add_scan(std::move(scan)); });
  for (ScanResult& each : scans) hand_over(std::move(each), frontend_timer_.newest_ms());
}

void ReplayPipeline::take_command(const lio_command_t& command) {
  const std::string refusal = messages::carry_out(command, lio_);
  if (!refusal.empty()) ++refused_commands_[refusal];
}

void ReplayPipeline::hand_over(ScanResult scan, double milliseconds) {
  if (!steps_.push({std::move(scan), milliseconds})) std::rethrow_exception(failure_);
}

void ReplayPipeline::follow() {
  try {
    while (const std::optional<Step> step = steps_.pop()) follower_.take(step->scan, step->milliseconds);
  } catch (...) {
    failure_ = std::current_exception();
    steps_.close();  // behind this the front end sees the failure, and does not wait for room for ever
  }
}

void ReplayPipeline::end_following() {
  if (!following_.joinable()) return;
  steps_.close();
  following_.join();
}

ReplayResult ReplayPipeline::finish() {
  end_following();
  if (failure_) std::rethrow_exception(failure_);
  ReplayResult result = follower_.finish();
  result.start = lio_.status().text;
  result.imu_samples = imu_samples_;
  result.rejected_imu = std::move(rejected_imu_);
  result.refused_commands = std::move(refused_commands_);
  return result;
}

}  // namespace ignis
