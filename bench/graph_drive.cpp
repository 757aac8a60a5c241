// SPDX-License-Identifier: Apache-2.0
//
// graph_drive: the back end alone over recorded keyframes (keyframe_log, or any log of a live run that holds
// LIO_KEYFRAME), with the processor time of each. Prints one JSON object; with --out also trajectories, loops and
// graph, and as distributed.tum what the reference would have made of the same loops. Like the processes, it begins
// anew with each session: what it writes is of the newest.
//
//     build/release/bin/graph_drive KEYFRAMES.lcm --config config/ignis8_tuned.json --set backend.SECTION.KEY=VALUE

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <vector>

#include <nlohmann/json.hpp>

#include "backend/smoother.h"
#include "common/trajectory_file.h"
#include "distributed_chain.h"
#include "keyframe_file.h"
#include "odometry_source.h"
#include "process_cost.h"
#include "runtime/application.h"

namespace {

using namespace ignis;
using bench::processor_ms;
using bench::quantile;

/// The newest keyframe as it was published.
struct NewestPose {
  Pose T_map_body;
  Matrix6d covariance;
};

/// The back end over one session's keyframes.
class Drive {
 public:
  explicit Drive(const runtime::IgnisConfig& config)
      : smoother_(config.backend, config.frontend.loop_gates),
        distributed_(config.frontend.loop_gates.loop_max_correction_m) {}

  void add(const Keyframe& keyframe) {
    const double began = processor_ms();
    const SmootherUpdate update = smoother_.add_keyframe(keyframe);
    times_ms_.push_back(processor_ms() - began);
    journal_bytes_ += static_cast<double>(smoother_.take_change().size());
    odometry_.push_back({keyframe.state.utime, keyframe.state.T_odom_body});
    if (!update.accepted()) return;
    stamps_.push_back(keyframe.state.utime);
    newest_.push_back({update.newest.T_odom_body, update.covariance});
    distributed_.add(keyframe.id, keyframe.state.T_odom_body);
    if (update.loop) note(*update.loop);
    for (const LoopResult& changed : update.changed) note(changed);
  }

  [[nodiscard]] nlohmann::ordered_json report() const {
    const SmootherStats stats = smoother_.stats();
    const double seconds = odometry_.empty() ? 0.0 : seconds_between(odometry_.front().utime, odometry_.back().utime);
    double sum = 0.0;
    for (const double ms : times_ms_) sum += ms;
    return {{"keyframes", stats.keyframes},
            {"drive_s", seconds},
            {"loops", stats.loops_kept},
            {"waiting", stats.loops_waiting},
            {"withdrawn", stats.loops_withdrawn},
            {"kB_per_keyframe", (bench::resident_bytes() - bytes_before_) / 1e3 / std::max(1, stats.keyframes)},
            {"journal_kB_per_keyframe", journal_bytes_ / 1e3 / std::max(1, stats.keyframes)},
            {"cpu_s", sum / 1e3},
            {"cpu_ms_per_drive_s", sum / std::max(seconds, 1e-9)},
            {"p50_ms", quantile(times_ms_, 0.5)},
            {"p99_ms", quantile(times_ms_, 0.99)},
            {"max_ms", quantile(times_ms_, 1.0)}};
  }

  void write(const std::filesystem::path& folder) const {
    std::filesystem::create_directories(folder);
    write_tum(folder / "eskf.tum", odometry_);
    Trajectory smoothed;
    Trajectory distributed;
    const std::vector<KeyframePose> poses = smoother_.all_poses();
    for (std::size_t i = 0; i < stamps_.size(); ++i) {
      smoothed.push_back({stamps_[i], poses[i].T_map_body});
      distributed.push_back({stamps_[i], distributed_.poses()[i]});
    }
    write_tum(folder / "smoothed.tum", smoothed);
    write_tum(folder / "distributed.tum", distributed);
    write_pose_graph(folder / "keyframes.g2o", smoother_.pose_graph());
    write_newest(folder / "newest.csv");
    std::ofstream loops(folder / "loops.csv");
    loops << "utime,from,to,stage,reason,candidates,passed,correction_m,mean_residual,matched,overlap,text\n";
    for (const std::string& line : loop_lines_) loops << line << '\n';
    std::ofstream times(folder / "times.csv");
    times << "ms\n";
    for (const double ms : times_ms_) times << ms << '\n';
  }

 private:
  void note(const LoopResult& loop) {
    if (loop.reason == LoopReason::kAccepted) distributed_.close(loop);
    loop_lines_.push_back(std::format("{},{},{},{},{},{},{},{:.4f},{:.4f},{:.3f},{:.3f},\"{}\"", loop.utime,
                                      loop.from_id, loop.to_id, static_cast<int>(loop.stage), text(loop.reason),
                                      loop.candidates, loop.passed, loop.correction_m, loop.mean_residual,
                                      loop.matched_fraction, loop.overlap, loop.reason_text));
  }

  /// The newest pose after each keyframe and the covariance that was published with it: attitude then position, body
  /// axes, upper triangle row by row.
  void write_newest(const std::filesystem::path& file) const {
    std::ofstream out(file);
    out << "utime,x,y,z,qx,qy,qz,qw,covariance\n";
    for (std::size_t i = 0; i < newest_.size(); ++i) {
      const Pose& pose = newest_[i].T_map_body;
      const Eigen::Vector3d& t = pose.translation;
      const Eigen::Vector4d q = pose.rotation.coeffs();
      out << std::format("{},{},{},{},{},{},{},{}", stamps_[i], t.x(), t.y(), t.z(), q(0), q(1), q(2), q(3));
      for (int row = 0; row < 6; ++row) {
        for (int column = row; column < 6; ++column) out << std::format(",{}", newest_[i].covariance(row, column));
      }
      out << '\n';
    }
  }

  double bytes_before_ = bench::resident_bytes();
  Smoother smoother_;
  bench::DistributedChain distributed_;
  double journal_bytes_ = 0.0;
  std::vector<double> times_ms_;
  Trajectory odometry_;
  std::vector<Utime> stamps_;
  std::vector<NewestPose> newest_;
  std::vector<std::string> loop_lines_;
};

}  // namespace

int main(int argc, char** argv) {
  std::string log;
  std::string folder;
  std::string odometry = "scans";
  return runtime::run_application(
      "graph_drive", "Runs the back end over recorded keyframes.", argc, argv,
      [&](CLI::App& app) {
        app.add_option("log", log, "LCM log with LIO_KEYFRAME")->required();
        app.add_option("-o,--out", folder, "folder for trajectories, loops and graph");
        app.add_option("--odometry", odometry, "what links two keyframes besides the IMU: scans, filter or nothing")
            ->check(CLI::IsMember({"scans", "filter", "nothing"}));
      },
      [&](const runtime::Application& application) {
        std::vector<Keyframe> keyframes = bench::read_keyframes(log);
        if (odometry == "filter") bench::link_by_filter(keyframes);
        if (odometry == "nothing") bench::link_by_nothing(keyframes);
        auto drive = std::make_unique<Drive>(application.config);
        std::int32_t session = keyframes.front().session;
        for (const Keyframe& keyframe : keyframes) {
          if (keyframe.session != session) drive = std::make_unique<Drive>(application.config);
          session = keyframe.session;
          drive->add(keyframe);
        }
        if (!folder.empty()) drive->write(folder);
        std::cout << drive->report().dump() << '\n';
        return runtime::kDone;
      });
}
