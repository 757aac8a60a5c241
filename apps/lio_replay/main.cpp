// SPDX-License-Identifier: Apache-2.0
//
// lio_replay: the whole pipeline over an LCM log, in one process and in log-time order, as fast as the machine allows.
// The same log gives the same bytes.

#include <algorithm>
#include <charconv>
#include <chrono>
#include <format>
#include <iostream>
#include <memory>
#include <thread>

#include "graph_agreement.h"
#include "replay_output.h"
#include "replay_progress.h"
#include "replay_summary.h"
#include "replay_verdict.h"
#include "runtime/stop_signal.h"

namespace {

using namespace ignis;

struct Options {
  std::string log;
  std::string folder;
  std::string speed = "max";
  double until_s = 0.0;  ///< 0: to the end
  bool no_loops = false;
};

/// How fast the drive passes: as fast as the machine allows, or so many times real time.
class Pace {
 public:
  explicit Pace(double speed) : speed_(speed) {}

  /// Sleeps until it is this measurement's turn, in short steps so that a stop is noticed.
  void wait_for(double drive_s) const {
    if (speed_ <= 0.0) return;
    const auto due = began_ + std::chrono::duration<double>(drive_s / speed_);
    while (std::chrono::steady_clock::now() < due && !runtime::stop_requested()) {
      const auto step = std::chrono::steady_clock::now() + std::chrono::milliseconds(50);
      std::this_thread::sleep_until(std::min<decltype(due)>(due, step));
    }
  }

 private:
  double speed_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

/// 0 for "max", which means no pace.
double speed_of(const std::string& text) {
  if (text == "max") return 0.0;
  double speed = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), speed);
  if (error != std::errc{} || end != text.data() + text.size() || !(speed > 0.0) || speed > 1e6) {
    throw runtime::UserError(
        std::format("--speed {}: allowed is max, or how many times real time (1 is real time)", text));
  }
  return speed;
}

std::unique_ptr<ReplayInput> open_log(const std::string& file) {
  try {
    return std::make_unique<ReplayInput>(file);
  } catch (const std::runtime_error& error) {
    throw runtime::UserError(error.what());
  }
}

void make_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw runtime::UserError(std::format("cannot make the folder {}: {}", folder, error.message()));
}

runtime::ExitCode replay(const runtime::Application& application, const Options& options) {
  const double speed = speed_of(options.speed);
  const auto began = std::chrono::steady_clock::now();
  const std::unique_ptr<ReplayInput> input = open_log(options.log);
  make_folder(options.folder);
  GraphComparison graph(input->live_results());
  ReplayPipeline pipeline(application.config, !options.no_loops, &graph,
                          input->live_results().first_session.value_or(0));
  const Utime first = input->inventory().first_utime;
  const Utime last = options.until_s > 0.0 ? std::min(input->inventory().last_utime, first + to_micros(options.until_s))
                                           : input->inventory().last_utime;
  ReplayProgress progress(first, last);
  const Pace pace(speed);
  input->run({.on_imu = [&](const ImuSample& sample) { pipeline.add_imu(sample); },
              .on_scan = [&](Scan scan) { pipeline.add_scan(std::move(scan)); },
              .on_command = [&](const lio_command_t& command) { pipeline.take_command(command); },
              .proceed =
                  [&](Utime utime) {
                    if (utime > last) return false;
                    progress.show(utime);
                    pace.wait_for(seconds_between(first, utime));
                    return !runtime::stop_requested();
                  }});
  const ReplayResult result = pipeline.finish();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - began;
  const ReplayTiming timing{.wall_s = wall.count()};
  const ReplaySource source{options.log, *input, agreement_with_live(input->live_results().scan_stats, result.scans),
                            graph.agreement(result.scans.empty() ? first : result.scans.back().utime)};
  write_results(options.folder, application, source, pipeline, result, timing);
  std::cout << summary(source, result, timing) << std::format("results:    {}\n", options.folder);
  return verdict(result, input->inventory(), runtime::stop_requested());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  return runtime::run_application(
      "lio_replay", "Runs the whole pipeline over an LCM log and writes trajectories, graph, map and a report.", argc,
      argv,
      [&](CLI::App& app) {
        app.add_option("log", options.log, "LCM log with L1_IMU and L1_SCAN");
        app.add_option("-o,--out", options.folder, "folder for the results");
        app.add_flag("--no-loops", options.no_loops, "leave out loop closing");
        app.add_option("--speed", options.speed, "max (default), or how many times real time; 1 is real time");
        app.add_option("--until", options.until_s, "end so many seconds behind the log's first measurement")
            ->check(CLI::Range(1e-3, 1e9));
      },
      [&](const runtime::Application& application) {
        if (options.log.empty() || options.folder.empty()) {
          throw runtime::UserError("give a log and --out FOLDER; --help shows all options");
        }
        return replay(application, options);
      });
}
