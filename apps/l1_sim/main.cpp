// SPDX-License-Identifier: Apache-2.0
//
// l1_sim: drives an L1 through a scene and emits its bytes, into a file or on a pseudo-terminal in real time.

#include <iostream>

#include "capture.h"
#include "live_stream.h"
#include "scene_summary.h"

namespace {

struct Options {
  std::string scene;
  std::uint64_t seed = 1;
  std::optional<double> duration_s;
  ignis::CaptureFiles capture;
  ignis::LiveOptions live;
  bool print_scene = false;
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("--scene", options.scene, "scene file, such as config/scenes/battery_hall.json")->required();
  app.add_option("--seed", options.seed, "seed of all noise")->capture_default_str();
  app.add_option("--duration", options.duration_s, "end after this many seconds of sensor time")
      ->check(CLI::PositiveNumber);
  auto* capture =
      app.add_option("--capture", options.capture.bytes, "write the bytes to this file, as fast as possible");
  app.add_option("--ground-truth", options.capture.ground_truth, "write the true poses to this TUM file")
      ->needs(capture);
  auto* pty =
      app.add_option("--pty", options.live.link, "offer the bytes in real time on a pseudo-terminal of this name")
          ->excludes(capture);
  app.add_option("--wait", options.live.wait_s, "seconds to wait for a reader of the pseudo-terminal")
      ->needs(pty)
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--print-scene", options.print_scene, "print what the scene holds and end");
}

ignis::runtime::ExitCode run(const Options& options, const ignis::runtime::Application& application) {
  using namespace ignis;
  const sim::SceneConfig scene = sim::load_scene(options.scene);
  if (options.print_scene) {
    std::cout << summary(scene);
    return runtime::kDone;
  }
  sim::L1Stream stream(scene, application.config.extrinsics, options.seed, options.duration_s);
  if (!options.capture.bytes.empty()) return write_capture(stream, options.capture);
  if (!options.live.link.empty()) return run_live(stream, options.live, application);
  throw runtime::UserError("nothing to do: give --capture FILE, --pty LINK or --print-scene");
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  return ignis::runtime::run_application(
      "l1_sim", "Simulated Unitree L1: a drive through a scene as the sensor's bytes, with ground truth.", argc, argv,
      [&options](CLI::App& app) { add_options(app, options); },
      [&options](const ignis::runtime::Application& application) { return run(options, application); });
}
