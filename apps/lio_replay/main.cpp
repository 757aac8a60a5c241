// SPDX-License-Identifier: Apache-2.0
//
// lio_replay: the whole pipeline over an LCM log, in one process and in log-time order, as fast as the machine allows.
// The same log gives the same bytes.

#include <chrono>
#include <format>
#include <iostream>
#include <optional>

#include <unistd.h>

#include "replay_output.h"
#include "runtime/stop_signal.h"

namespace {

using namespace ignis;

struct Options {
  std::string log;
  std::string folder;
  bool no_loops = false;
};

/// One line on the error stream that tells how far the replay is; rewritten on a terminal, every tenth in a log.
class Progress {
 public:
  explicit Progress(const LogInventory& inventory) : inventory_(inventory) {}

  void show(Utime utime) {
    const double total = seconds_between(inventory_.first_utime, inventory_.last_utime);
    const double done = seconds_between(inventory_.first_utime, utime);
    const int percent = total > 0.0 ? static_cast<int>(100.0 * done / total) : 100;
    if (percent < shown_ + (terminal_ ? 1 : 10)) return;
    shown_ = percent;
    const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
    const double left = done > 0.0 ? spent * (total - done) / done : 0.0;
    std::cerr << std::format("{}replay {:3d} %: {:.1f} of {:.1f} s, {:.1f} times real time, {:.0f} s left{}",
                             terminal_ ? "\r" : "", percent, done, total, done / std::max(spent, 1e-9), left,
                             terminal_ ? "   " : "\n");
    if (terminal_ && percent >= 100) std::cerr << '\n';
  }

 private:
  const LogInventory& inventory_;
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  int shown_ = -100;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

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
  const auto began = std::chrono::steady_clock::now();
  const std::unique_ptr<ReplayInput> input = open_log(options.log);
  make_folder(options.folder);
  ReplayPipeline pipeline(application.config, !options.no_loops);
  Progress progress(input->inventory());
  input->run([&](const ImuSample& sample) { pipeline.add_imu(sample); },
             [&](const Scan& scan) { pipeline.add_scan(scan); },
             [&](Utime utime) {
               progress.show(utime);
               return !runtime::stop_requested();
             });
  const ReplayResult result = pipeline.finish();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - began;
  const ReplayTiming timing{.wall_s = wall.count()};
  write_results(options.folder, application, options.log, *input, pipeline, result, timing);
  std::cout << summary(*input, result, timing) << std::format("results:    {}\n", options.folder);
  if (result.odometry.empty()) {
    throw runtime::UserError(std::format("no pose was computed: {}", result.start), runtime::kFailed);
  }
  if (runtime::stop_requested()) return runtime::kFailed;
  return input->inventory().damaged() ? runtime::kInputDamaged : runtime::kDone;
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
      },
      [&](const runtime::Application& application) {
        if (options.log.empty() || options.folder.empty()) {
          throw runtime::UserError("give a log and --out FOLDER; --help shows all options");
        }
        return replay(application, options);
      });
}
