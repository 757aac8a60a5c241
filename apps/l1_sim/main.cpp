// SPDX-License-Identifier: Apache-2.0
//
// l1_sim: drives an L1 through a scene and emits its bytes, into a file or in real time to a driver that it obeys. A
// scene with a spinning LiDAR goes into a log.

#include <format>
#include <iostream>
#include <thread>

#include "fault_report.h"
#include "live_stream.h"
#include "options.h"
#include "pty_line.h"
#include "runtime/stop_signal.h"
#include "scene_summary.h"
#include "spinning_log.h"
#include "udp_line.h"

namespace {

using namespace ignis;

/// False when a stop was asked for; throws when nobody came in time.
bool wait_for_reader(const PtyLine& line, const Options& options) {
  constexpr std::chrono::milliseconds kPoll{5};
  const std::string link = options.pty.string();
  std::cerr << std::format("l1_sim: the sensor's port is {}; waiting up to {:.0f} s for a reader\n", link,
                           *options.wait_s);
  const auto deadline = HostLine::Clock::now() + std::chrono::duration<double>(*options.wait_s);
  while (!line.has_reader()) {
    if (runtime::stop_requested()) return false;
    if (HostLine::Clock::now() > deadline) {
      throw runtime::UserError(
          std::format("nobody opened {} within {:.0f} s; start l1_driver --port {}, or give a longer --wait", link,
                      *options.wait_s, link),
          runtime::kFailed);
    }
    std::this_thread::sleep_for(kPoll);
  }
  return true;
}

runtime::ExitCode run_on_line(const Options& options, sim::L1Stream& stream, sim::ByteFaults& faults,
                              const runtime::Application& application) {
  sim::HostListener listener(options.device, options.seed);
  if (!options.udp.empty()) {
    UdpLine line(options.udp);
    return run_live({stream, faults, listener, line}, application);
  }
  PtyLine line(options.pty);
  if (!wait_for_reader(line, options)) return runtime::kDone;
  return run_live({stream, faults, listener, line}, application);
}

runtime::ExitCode run(const Options& options, const runtime::Application& application) {
  const sim::SceneConfig scene = sim::load_scene(options.scene);
  if (options.print_scene) {
    std::cout << summary(scene);
    return runtime::kDone;
  }
  if (scene.lidar.is_spinning()) {
    require_log_only(options);
    sim::SpinningStream stream(scene, application.config.extrinsics, options.seed, options.duration_s);
    return write_spinning_log(stream, options.files, application);
  }
  sim::L1Stream stream(scene, application.config.extrinsics, options.seed, options.duration_s, options.device);
  sim::ByteFaults faults(options.faults, options.fault_seed);
  const runtime::ExitCode code = options.is_live() ? run_on_line(options, stream, faults, application)
                                                   : write_files(stream, faults, options.files, application);
  if (!options.fault_list.empty()) write_fault_list(options.fault_list, faults);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  return runtime::run_application(
      "l1_sim", "Simulated Unitree L1: a drive through a scene as the sensor's bytes, with ground truth.", argc, argv,
      [&options](CLI::App& app) { add_options(app, options); },
      [&options](const runtime::Application& application) { return run(checked(options), application); });
}
