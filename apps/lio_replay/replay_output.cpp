// SPDX-License-Identifier: Apache-2.0
#include "replay_output.h"

#include <algorithm>
#include <format>

#include "common/file_output.h"
#include "common/fingerprint.h"
#include "map/map_export.h"
#include "replay_figures.h"
#include "replay_verdict.h"
#include "runtime/version.h"

namespace ignis {
namespace {

using config::Json;

void write_scan_stats(const std::filesystem::path& file, const ReplayResult& result) {
  FileOutput output(file);
  output.stream() << "utime,scan_sequence,applied,reason,points,matched,used,mean_innovation_m,mean_residual_m,"
                     "correction_m,correction_rad,velocity_correction_m_s,observability_x,observability_y,"
                     "observability_z,degenerate_directions,nis,nis_directions,standing,imu_disagreement,map_points\n";
  for (const ScanStats& s : result.scans) {
    output.stream() << std::format(
        "{},{},{},\"{}\",{},{},{},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.4f},{:.4f},{:.4f},{},{:.4f},{},{},{:.3f},{}\n",
        s.utime, s.scan_sequence, s.applied() ? 1 : 0, text(s.reason), s.points, s.matched, s.used, s.mean_innovation,
        s.mean_residual, s.correction_m, s.correction_rad, s.velocity_correction, s.observability.x(),
        s.observability.y(), s.observability.z(), s.degenerate_directions, s.nis, s.nis_directions, s.standing ? 1 : 0,
        s.imu_disagreement, s.map_points);
  }
  output.commit();
}

void append(std::string& row, const Eigen::Vector3d& values) {
  for (const double value : values) row += std::format(",{:.9g}", value);
}

/// Velocity, biases and covariance on the stamps of eskf.tum. Columns p00 to p55: upper triangle of the pose's, row by
/// row, attitude (body axes) then position (odom axes); sigma_*: roots of the other variances; trust: 0 OK, 1 degraded,
/// 2 lost.
void write_states(const std::filesystem::path& file, const ReplayResult& result) {
  FileOutput output(file);
  output.stream() << "utime";
  for (const char* name : {"v", "gyro_bias", "accel_bias", "sigma_v", "sigma_gyro_bias", "sigma_accel_bias"}) {
    for (const char axis : {'x', 'y', 'z'}) output.stream() << std::format(",{}_{}", name, axis);
  }
  for (int i = 0; i < 6; ++i) {
    for (int k = i; k < 6; ++k) output.stream() << std::format(",p{}{}", i, k);
  }
  output.stream() << ",trust\n";
  for (const auto& [state, covariance, trust] : result.states) {
    std::string row = std::to_string(state.utime);
    append(row, state.v_odom);
    append(row, state.gyro_bias);
    append(row, state.accel_bias);
    for (const int block : {kVelocity, kGyroBias, kAccelBias}) {
      append(row, covariance.diagonal().segment<3>(block).cwiseSqrt());
    }
    for (int i = 0; i < 6; ++i) {
      for (int k = i; k < 6; ++k) row += std::format(",{:.9g}", covariance(i, k));
    }
    output.stream() << row << std::format(",{}\n", static_cast<int>(trust));
  }
  output.commit();
}

void write_loops(const std::filesystem::path& file, const ReplayResult& result) {
  FileOutput output(file);
  output.stream() << "utime,from_id,to_id,accepted,reason,candidates,passed,correction_m,correction_rad,"
                     "mean_residual_m,matched_fraction,overlap,stage,chi_square,chi_square_bound\n";
  for (const LoopResult& loop : result.loops) {
    output.stream() << std::format("{},{},{},{},\"{}\",{},{},{:.6f},{:.6f},{:.6f},{:.4f},{:.4f},\"{}\",{:.3f},{:.3f}\n",
                                   loop.utime, loop.from_id, loop.to_id, loop.accepted() ? 1 : 0, text(loop.reason),
                                   loop.candidates, loop.passed, loop.correction_m, loop.correction_rad,
                                   loop.mean_residual, loop.matched_fraction, loop.overlap, text(loop.stage),
                                   loop.chi_square, loop.chi_square_bound);
  }
  output.commit();
}

/// Apart from the other tables, whose bytes do not depend on the machine.
void write_timing(const std::filesystem::path& file, const ReplayResult& result) {
  FileOutput output(file);
  output.stream() << "utime,frontend_ms\n";
  for (std::size_t i = 0; i < result.scans.size(); ++i) {
    output.stream() << std::format("{},{:.4f}\n", result.scans[i].utime, result.scan_times_ms[i]);
  }
  output.commit();
}

void write_text(const std::filesystem::path& file, const std::string& content) {
  FileOutput output(file);
  output.stream() << content;
  output.commit();
}

Json timer_json(const StageTimer& timer) {
  return {{"calls", timer.calls()},
          {"total_ms", timer.total_ms()},
          {"p50_ms", timer.quantile_ms(0.5)},
          {"p99_ms", timer.quantile_ms(0.99)}};
}

/// Median per quarter of the drive: what a scan costs must not grow with the way driven.
std::vector<double> medians_by_quarter(const std::vector<double>& values) {
  std::vector<double> medians;
  for (std::size_t quarter = 0; quarter < 4; ++quarter) {
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(quarter * values.size() / 4);
    const auto end = values.begin() + static_cast<std::ptrdiff_t>((quarter + 1) * values.size() / 4);
    medians.push_back(quantile({begin, end}, 0.5));
  }
  return medians;
}

Json drop_json(const LogInventory& inventory) {
  if (!inventory.first_drop) return nullptr;
  return {{"s", seconds_between(inventory.first_utime, inventory.first_drop->utime)},
          {"utime", inventory.first_drop->utime},
          {"what", inventory.first_drop->what}};
}

Json inventory_json(const LogInventory& inventory) {
  return {{"used", inventory.used},
          {"ignored", inventory.ignored},
          {"undecodable", inventory.undecodable},
          {"incomplete_scans", inventory.incomplete_scans},
          {"missing_imu", inventory.missing_imu},
          {"missing_scans", inventory.missing_scans},
          {"damaged_bytes", inventory.damaged_bytes},
          {"out_of_order", inventory.out_of_order},
          {"first_utime", inventory.first_utime},
          {"first_drop", drop_json(inventory)}};
}

/// What the graph has changed, and what may be expected of that.
Json smoothing_json(const ReplayResult& result) {
  double largest_m = 0.0;
  double largest_rad = 0.0;
  for (std::size_t i = 0; i < result.odometry.size(); ++i) {
    const Vector6d moved = body_difference(result.odometry[i].T_world_body, result.smoothed[i].T_world_body);
    largest_rad = std::max(largest_rad, moved.head<3>().norm());
    largest_m = std::max(largest_m, moved.tail<3>().norm());
  }
  const char* expectation = result.smoother.loops_kept > 0 ? "loops tie places together"
                            : result.smoother.keyframes < 2
                                ? "no gain: the graph holds no motion, smoothed equals ESKF-only"
                                : "no gain in position: without a loop the graph knows nothing that the filter did not";
  return {{"loops", result.smoother.loops_kept},
          {"largest_shift_m", largest_m},
          {"largest_turn_rad", largest_rad},
          {"expectation", expectation}};
}

Json channel_json(const ChannelAgreement& channel, Utime first) {
  Json json = {{"recorded", channel.recorded}, {"equal", channel.equal}, {"first_unequal_s", nullptr}};
  if (channel.first_unequal) json["first_unequal_s"] = seconds_between(first, *channel.first_unequal);
  return json;
}

Json graph_json(const GraphAgreement& graph, const std::optional<Utime>& command, Utime first) {
  Json json = {{"keyframes", channel_json(graph.keyframes, first)},
               {"revisions", channel_json(graph.revisions, first)},
               {"loop_results", channel_json(graph.loops, first)},
               {"smoothed_states", channel_json(graph.smoothed_states, first)},
               {"first_command_s", nullptr}};
  if (command) json["first_command_s"] = seconds_between(first, *command);
  return json;
}

Json live_json(const LiveAgreement& live, Utime first) {
  Json json = {{"recorded_scans", live.recorded},
               {"equal_scans", live.equal},
               {"first_sequence", live.first_sequence},
               {"largest_distance_m", live.largest_distance_m},
               {"first_unequal_s", nullptr}};
  if (live.first_unequal) json["first_unequal_s"] = seconds_between(first, *live.first_unequal);
  return json;
}

Json report(const runtime::Application& application, const ReplaySource& source, const ReplayPipeline& pipeline,
            const ReplayResult& result, const ReplayTiming& timing) {
  const ReplayInput& input = source.input;
  const double seconds = drive_seconds(input, result);
  const auto accepted = std::ranges::count_if(result.loops, [](const LoopResult& loop) { return loop.accepted(); });
  Json json;
  json["log"] = source.log.filename().string();
  json["log_path"] = std::filesystem::absolute(source.log).lexically_normal().string();
  json["version"] = runtime::version();
  json["config_hash"] = application.config_hash;
  json["start"] = result.start;
  json["duration_s"] = seconds;
  json["input"] = inventory_json(input.inventory());
  json["live"] = live_json(source.live, input.inventory().first_utime);
  json["live"]["graph"] = graph_json(source.graph, input.live_results().first_command, input.inventory().first_utime);
  json["imu_samples"] = result.imu_samples;
  json["imu_rejected"] = result.rejected_imu;
  json["scans"] = result.scans.size();
  json["scans_applied"] = applied_scans(result);
  json["scans_by_reason"] = scans_by_reason(result);
  json["scans_with_unobserved_directions"] =
      std::ranges::count_if(result.scans, [](const ScanStats& scan) { return scan.degenerate_directions > 0; });
  json["sessions"] = result.sessions;
  json["refused_commands"] = result.refused_commands;
  json["keyframes"] = result.smoother.keyframes;
  json["keyframes_retired"] = result.smoother.retired;
  json["keyframes_absorbed"] = result.smoother.absorbed;
  json["keyframes_without_imu"] = result.smoother.without_imu;
  json["keyframes_refused"] = result.keyframes_refused;
  json["map_refusals"] = result.map_refusals;
  json["refusals"] = refusals(result);
  json["solver_failure"] = result.solver_failure;
  json["loops_accepted"] = accepted;
  json["loops_kept"] = result.smoother.loops_kept;
  json["loops_withdrawn"] = result.smoother.loops_withdrawn;
  json["smoothing"] = smoothing_json(result);
  json["batch_optimum"] = {{"solved", result.optimum.solved},
                           {"largest_gap_m", result.optimum.largest_gap_m},
                           {"largest_gap_rad", result.optimum.largest_gap_rad},
                           {"half_chi_square", result.optimum.half_chi_square},
                           {"half_chi_square_incremental", result.optimum.half_chi_square_before},
                           {"swapped_in", result.smoother.shadow_swaps > 0}};
  json["solver_rebuilds"] = result.smoother.solver_rebuilds;
  json["voxels"] = {{"local", pipeline.follower().voxels().size(0)},
                    {"mid", pipeline.follower().voxels().size(1)},
                    {"coarse", pipeline.follower().voxels().size(2)}};
  json["trajectory_hash"] = trajectory_hash(result);
  json["map_hash"] = pipeline.follower().voxels().fingerprint();
  json["timing"] = {{"wall_s", timing.wall_s},
                    {"real_time_factor", timing.wall_s > 0.0 ? seconds / timing.wall_s : 0.0},
                    {"scan_p50_ms", quantile(result.scan_times_ms, 0.5)},
                    {"scan_p99_ms", quantile(result.scan_times_ms, 0.99)},
                    {"scan_p50_ms_by_quarter", medians_by_quarter(result.scan_times_ms)},
                    {"frontend", timer_json(pipeline.frontend_timer())},
                    {"backend", timer_json(pipeline.follower().backend_timer())},
                    {"batch_optimum", timer_json(pipeline.follower().batch_timer())},
                    {"map", timer_json(pipeline.follower().map_timer())}};
  return json;
}

/// Ground truth on the stamps of the odometry, so that all trajectories of a folder share them.
Trajectory sampled(const Trajectory& truth, const Trajectory& stamps) {
  Trajectory rows;
  for (const StampedPose& stamp : stamps) {
    const auto next = std::ranges::lower_bound(truth, stamp.utime, {}, &StampedPose::utime);
    if (next == truth.end() || (next == truth.begin() && next->utime != stamp.utime)) continue;
    if (next->utime == stamp.utime) {
      rows.push_back(*next);
      continue;
    }
    const StampedPose& before = *std::prev(next);
    const double ratio = seconds_between(before.utime, stamp.utime) / seconds_between(before.utime, next->utime);
    rows.push_back({stamp.utime, interpolate(before.T_world_body, next->T_world_body, ratio)});
  }
  return rows;
}

}  // namespace

std::string trajectory_hash(const ReplayResult& result) {
  Fingerprint fingerprint;
  for (const Trajectory* trajectory : {&result.odometry, &result.smoothed}) {
    for (const StampedPose& row : *trajectory) {
      fingerprint.add(row.utime);
      for (const double value : row.T_world_body.translation) fingerprint.add(value);
      for (const double value : row.T_world_body.rotation.coeffs()) fingerprint.add(value);
    }
  }
  return fingerprint.text();
}

std::filesystem::path write_results(const std::filesystem::path& folder, const runtime::Application& application,
                                    const ReplaySource& source, const ReplayPipeline& pipeline,
                                    const ReplayResult& result, const ReplayTiming& timing) {
  write_tum(folder / "eskf.tum", result.odometry);
  write_tum(folder / "smoothed.tum", result.smoothed);
  if (!source.input.ground_truth().empty()) {
    write_tum(folder / "ground_truth.tum", sampled(source.input.ground_truth(), result.odometry));
  }
  write_pose_graph(folder / "keyframes.g2o", result.graph);
  write_pcd(folder / "map.pcd", pipeline.follower().voxels());
  write_ply(folder / "map.ply", pipeline.follower().voxels());
  write_scan_stats(folder / "scan_stats.csv", result);
  write_states(folder / "eskf_states.csv", result);
  write_loops(folder / "loops.csv", result);
  write_timing(folder / "timing.csv", result);
  write_text(folder / "config.json", print_config(application.config));
  const std::filesystem::path file = folder / "report.json";
  write_text(file, report(application, source, pipeline, result, timing).dump(2) + '\n');
  return file;
}

}  // namespace ignis
