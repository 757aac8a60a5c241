// SPDX-License-Identifier: Apache-2.0
//
// endless_drive: front end, back end with its journal, and map over simulated hours of a drive whose laps repeat, in
// one thread and as fast as it goes: what a day costs, and what grows. One CSV row for each hour; times in ms of
// processor time, memory in MB; scans and times are of the hour, all else since the beginning.
//
//     ninja -C build/release endless_drive
//     build/release/bin/endless_drive LAPS.lcm --config config/ignis8_tuned.json --hours 24 --journal FOLDER

#include <malloc.h>

#include <filesystem>
#include <format>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "aligned_error.h"
#include "backend/shadow/shadow_schedule.h"
#include "frontend/lio.h"
#include "graph_backend/lasting_graph.h"
#include "lap_source.h"
#include "map/live_map.h"
#include "messages/keyframe_messages.h"
#include "process_cost.h"
#include "runtime/application.h"
#include "runtime/stop_signal.h"

namespace {

using namespace ignis;
using bench::processor_ms;
using bench::quantile;

constexpr double kHour = 3600.0;

/// What the process has asked for and not given back [MB].
double live_mb() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd) / 1e6;
}

/// Processor times of one kind of work since they were last told [ms].
class Times {
 public:
  void add(double ms) { ms_.push_back(ms); }

  static std::string head(const std::string& name) { return std::format("{0}_p50,{0}_p99,{0}_max,{0}_s", name); }

  /// Median, 99th percentile, largest, and sum in seconds; begins anew.
  std::string tell() {
    double sum = 0.0;
    for (const double ms : ms_) sum += ms;
    const std::string row = std::format("{:.2f},{:.2f},{:.1f},{:.1f}", quantile(ms_, 0.5), quantile(ms_, 0.99),
                                        quantile(ms_, 1.0), sum / 1e3);
    ms_.clear();
    return row;
  }

 private:
  std::vector<double> ms_;
};

/// Runs `work`, notes how long it took, and returns what it returns.
auto timed(Times& times, auto&& work) {
  const double began = processor_ms();
  auto result = work();
  times.add(processor_ms() - began);
  return result;
}

/// The cores as the processes run them, with keyframes rounded as on the bus. The batch optimum is solved when it is
/// taken over, in this thread.
class Drive {
 public:
  Drive(const runtime::IgnisConfig& config, const std::filesystem::path& journal, const bench::LapSource& source)
      : source_(source), lio_(config.frontend.filter), graph_(config, journal), map_(config.map) {
    graph_.begin_session(0);
  }

  void add_imu(const ImuSample& sample) {
    take([&] { return lio_.add_imu(sample).scans; });
  }
  void add_scan(Scan scan) {
    take([&] { return lio_.add_scan(std::move(scan)); });
  }

  static std::string head() {
    return std::format(
        "hour,sessions,scans,not_applied,{},keyframes,refused,loops,on_trial,waiting,withdrawn,{},{},swaps,{},rebuilds,"
        "live_mb,live_graph_mb,resident_mb,clouds_of_map,ate_odometry_m,ate_smoothed_m",
        Times::head("scan"), Times::head("update"), Times::head("batch"), Times::head("map"));
  }

  /// What became of the hour that has just ended.
  std::string tell(int hour) {
    const SmootherStats stats = graph_.smoother().stats();
    const double live = live_mb();  // before the row's own lists
    const double resident = bench::resident_bytes() / 1e6;
    const std::string row =
        std::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{:.1f},{:.1f},{:.1f},{},{:.4f},{:.4f}", hour,
                    sessions_, scans_, not_applied_, scan_times_.tell(), stats.keyframes, refused_, stats.loops_kept,
                    stats.loops_on_trial, stats.loops_waiting, stats.loops_withdrawn, update_times_.tell(),
                    batch_times_.tell(), stats.shadow_swaps, map_times_.tell(), map_.rebuilds(), live, graph_mb_,
                    resident, map_.clouds().size(), error_of(odometry_), error_of(smoothed()));
    scans_ = 0;
    not_applied_ = 0;
    return row;
  }

 private:
  void take(auto&& work) {
    const double began = processor_ms();
    const std::vector<ScanResult> results = work();
    if (results.empty()) return;
    scan_times_.add(processor_ms() - began);
    for (const ScanResult& result : results) take_scan(result);
  }

  void take_scan(const ScanResult& scan) {
    ++scans_;
    if (!scan.stats.applied()) ++not_applied_;
    if (!scan.has_state) return;
    follow_session(scan.stats.session);
    if (scan.keyframe) {
      for (const keyframe_t& part : messages::to_messages(*scan.keyframe)) {
        if (const std::optional<Keyframe> keyframe = assembler_.add(part)) take_keyframe(*keyframe);
      }
    }
    const double began = processor_ms();
    map_.insert_scan(scan.cloud, scan.state.T_odom_body);
    rebuild_map();
    map_times_.add(processor_ms() - began);
  }

  void follow_session(std::int32_t session) {
    if (session == graph_.session()) return;
    ++sessions_;
    const double before = live_mb();
    graph_.begin_session(session);
    graph_mb_ += live_mb() - before;
    schedule_ = {};
    map_.clear();
    odometry_.clear();
    truth_.clear();
  }

  void take_keyframe(const Keyframe& keyframe) {
    map_.add_keyframe(keyframe);
    adopt_due_optimum();
    const double before = live_mb();
    const SmootherUpdate update = timed(update_times_, [&] {
      return graph_.change([&](Smoother& smoother) { return smoother.add_keyframe(keyframe); });
    });
    graph_mb_ += live_mb() - before;
    graph_.maintain();
    if (update.accepted()) {
      odometry_.push_back(keyframe.state.T_odom_body);
      truth_.push_back(source_.truth_at(keyframe.state.utime));
      publish(update);
    } else {
      ++refused_;
    }
  }

  void adopt_due_optimum() {
    if (!schedule_.adoption_due(graph_.smoother().stats().keyframes)) return;
    schedule_.end();
    const ShadowOptimum optimum = timed(batch_times_, [&] { return solve(std::exchange(problem_, {})); });
    const int swaps = graph_.smoother().stats().shadow_swaps;
    const SmootherUpdate update = graph_.change([&](Smoother& smoother) { return smoother.adopt(optimum); });
    if (graph_.smoother().stats().shadow_swaps != swaps) publish(update);
  }

  void publish(const SmootherUpdate& update) {
    if (update.loop && update.loop->accepted()) map_.add_loop(update.loop->from_id, update.loop->to_id);
    for (const LoopResult& loop : update.changed) {
      if (loop.accepted()) map_.add_loop(loop.from_id, loop.to_id);
      if (loop.reason == LoopReason::kWithdrawn) map_.remove_loop(loop.from_id, loop.to_id);
    }
    std::vector<CorrectedPose> poses;
    for (const KeyframePose& pose : update.moved) poses.push_back({pose.id, pose.T_map_body});
    map_.correct(update.T_map_odom, poses, update.revision);
    schedule_.note(update);
    if (!schedule_.begin_due()) return;
    schedule_.begin(graph_.smoother().stats());
    problem_ = graph_.shadow_problem();
  }

  void rebuild_map() {
    if (map_.needs_rebuild()) map_.finish_rebuild(rebuild(map_.begin_rebuild()));
  }

  [[nodiscard]] double error_of(const std::vector<Pose>& poses) const {
    return poses.empty() ? 0.0 : bench::aligned_error(poses, truth_);
  }

  [[nodiscard]] std::vector<Pose> smoothed() const {
    std::vector<Pose> poses;
    for (const KeyframePose& pose : graph_.smoother().all_poses()) poses.push_back(pose.T_map_body);
    return poses;
  }

  const bench::LapSource& source_;
  Lio lio_;
  messages::KeyframeAssembler assembler_;
  LastingGraph graph_;
  ShadowSchedule schedule_;
  ShadowProblem problem_;
  LiveMap map_;
  std::vector<Pose> odometry_;  // of the accepted keyframes, and the next
  std::vector<Pose> truth_;
  Times scan_times_;
  Times update_times_;
  Times batch_times_;
  Times map_times_;  // a scan and what it leads to
  double graph_mb_ = 0.0;
  int scans_ = 0;
  int not_applied_ = 0;
  int refused_ = 0;
  int sessions_ = 1;
};

struct Options {
  std::string log;
  std::string journal;
  double hours = 1.0;
};

runtime::ExitCode run(const runtime::Application& application, const Options& options) {
  const bench::LapSource source(options.log);
  Drive drive(application.config, options.journal, source);
  std::cerr << std::format("one lap: {:.1f} s\n", source.lap_s());
  std::cout << Drive::head() << std::endl;
  std::optional<Utime> first;
  int told = 0;
  const auto tell_the_hour = [&](Utime utime) {
    if (!first) first = utime;
    if (seconds_between(*first, utime) < kHour * (told + 1)) return;
    std::cout << drive.tell(++told) << std::endl;
  };
  source.run(
      kHour * options.hours,
      [&](const ImuSample& sample) {
        tell_the_hour(sample.utime);
        drive.add_imu(sample);
      },
      [&](Scan scan) { drive.add_scan(std::move(scan)); }, [] { return !runtime::stop_requested(); });
  std::cout << drive.tell(told + 1) << std::endl;
  return runtime::kDone;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  return runtime::run_application(
      "endless_drive", "Runs all cores over simulated hours of a drive whose laps repeat.", argc, argv,
      [&](CLI::App& app) {
        app.add_option("log", options.log, "LCM log with L1_IMU, L1_SCAN and GROUND_TRUTH")->required();
        app.add_option("--hours", options.hours, "of the sensor's time")->check(CLI::Range(0.01, 240.0));
        app.add_option("--journal", options.journal, "folder for the back end's journal")->required();
      },
      [&](const runtime::Application& application) { return run(application, options); });
}
