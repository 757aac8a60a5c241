// SPDX-License-Identifier: Apache-2.0
#include "replay_summary.h"

#include <algorithm>
#include <format>
#include <utility>

#include "replay_figures.h"
#include "replay_verdict.h"

namespace ignis {
namespace {

std::string losses(const LogInventory& inventory) {
  std::string text;
  if (inventory.missing_imu + inventory.missing_scans > 0) {
    text += std::format("missing:    {} IMU samples and {} scans by their running numbers: the log never held them\n",
                        inventory.missing_imu, inventory.missing_scans);
  }
  if (inventory.out_of_order > 0) {
    text += std::format("order:      {} measurements were recorded late and put in the order of their stamps\n",
                        inventory.out_of_order);
  }
  if (inventory.damaged()) {
    text += std::format("damaged:    {} bytes in no whole record, {} messages undecodable, {} scans incomplete\n",
                        inventory.damaged_bytes, inventory.undecodable, inventory.incomplete_scans);
  }
  if (inventory.first_drop) {
    text +=
        std::format("first drop: at {:.3f} s: {}\n",
                    seconds_between(inventory.first_utime, inventory.first_drop->utime), inventory.first_drop->what);
  }
  return text;
}

std::string graph_agreement(const ReplaySource& source) {
  const Utime first = source.input.inventory().first_utime;
  const std::pair<const char*, const ChannelAgreement*> channels[] = {
      {"keyframe messages", &source.graph.keyframes},
      {"messages of corrected poses", &source.graph.revisions},
      {"loop results", &source.graph.loops},
      {"smoothed states", &source.graph.smoothed_states}};
  std::string text;
  for (const auto& [name, channel] : channels) {
    if (channel->recorded == 0) continue;
    text += std::format("            {} of {} {}", channel->equal, channel->recorded, name);
    if (channel->first_unequal) {
      text += std::format("; the first that differs is of {:.3f} s", seconds_between(first, *channel->first_unequal));
    }
    text += '\n';
  }
  if (const std::optional<Utime>& command = source.input.live_results().first_command) {
    text += std::format("            at {:.3f} s somebody had a loop taken out of the live graph; a replay does not\n",
                        seconds_between(first, *command));
  }
  return text;
}

/// Whether the replay gave what the live run had given.
std::string agreement(const ReplaySource& source) {
  const LiveAgreement& live = source.live;
  if (live.recorded == 0) return {};
  std::string text = std::format("live run:   {} of {} recorded scans equal bit for bit", live.equal, live.recorded);
  if (live.first_unequal) {
    text += std::format("; the first that differs ends at {:.3f} s, positions differ by at most {:.6f} m",
                        seconds_between(source.input.inventory().first_utime, *live.first_unequal),
                        live.largest_distance_m);
    if (live.first_sequence > 0) {
      text += std::format("; the recording began when the live run had {} scans behind it", live.first_sequence);
    }
  }
  return text + '\n' + graph_agreement(source);
}

}  // namespace

std::string summary(const ReplaySource& source, const ReplayResult& result, const ReplayTiming& timing) {
  const double seconds = drive_seconds(source.input, result);
  std::string text = std::format("start:      {}\n", result.start);
  text +=
      std::format("drive:      {:.1f} s, {} IMU samples, {} scans\n", seconds, result.imu_samples, result.scans.size());
  text += std::format("scans:      {} applied", applied_scans(result));
  for (const auto& [reason, count] : scans_by_reason(result)) {
    if (reason != ignis::text(ScanReason::kApplied)) text += std::format(", {} {}", count, reason);
  }
  text += std::format("\ngraph:      {} keyframes, {} loops kept, {} withdrawn", result.smoother.keyframes,
                      result.smoother.loops_kept, result.smoother.loops_withdrawn);
  if (result.sessions > 1)
    text += std::format("; of the last of {} sessions, which begin where the map is lost or a command says so",
                        result.sessions);
  text += '\n';
  if (const std::string refused = refusals(result); !refused.empty()) text += std::format("refused:    {}\n", refused);
  for (const auto& [reason, count] : result.refused_commands) {
    text += std::format("refused:    {} commands to the live front end: {}\n", count, reason);
  }
  if (!result.solver_failure.empty()) text += std::format("graph ends: {}\n", result.solver_failure);
  text +=
      std::format("time:       {:.2f} s, {:.1f} times real time; a scan takes {:.2f} ms (median), {:.2f} ms (p99)\n",
                  timing.wall_s, seconds / std::max(timing.wall_s, 1e-9), quantile(result.scan_times_ms, 0.5),
                  quantile(result.scan_times_ms, 0.99));
  text += std::format("trajectory: {}\n", trajectory_hash(result));
  return text + losses(source.input.inventory()) + agreement(source);
}

}  // namespace ignis
