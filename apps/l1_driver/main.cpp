// SPDX-License-Identifier: Apache-2.0
//
// l1_driver: reads a Unitree L1, or a recording of one, and publishes its measurements.

#include "capture_player.h"
#include "live_driver.h"

namespace ignis::runtime {
namespace {

struct Options {
  std::string port;
  std::string capture;
  std::string record;
};

ExitCode run(const Application& application, const Options& options) {
  if (!options.capture.empty()) return play_capture(application, options.capture);
  Application with_port = application;
  if (!options.port.empty()) with_port.config.driver.port = options.port;
  try {
    return LiveDriver(with_port, options.record).run();
  } catch (const l1::LinkError& error) {
    throw UserError(error.what(), kFailed);
  }
}

}  // namespace
}  // namespace ignis::runtime

int main(int argc, char** argv) {
  using namespace ignis::runtime;
  Options options;
  return run_application(
      "l1_driver", "Reads a Unitree L1 and publishes L1_IMU, L1_SCAN and L1_STATUS", argc, argv,
      [&](CLI::App& app) {
        auto* port =
            app.add_option("--port", options.port, "serial device, pty or udp://ADDRESS:PORT (default: driver.port)");
        auto* record = app.add_option("--record", options.record, "also write the raw bytes into this new file");
        app.add_option("--capture", options.capture, "decode this file of raw bytes instead of a device")
            ->excludes(port)
            ->excludes(record);
      },
      [&](const Application& application) { return run(application, options); });
}
