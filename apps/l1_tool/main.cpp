// SPDX-License-Identifier: Apache-2.0
//
// l1_tool: talks to an L1, looks into recordings of it, and checks its mount. The driver must not run meanwhile: a
// serial port has one owner.

#include "decode.h"
#include "mount_check.h"
#include "sensor_commands.h"

namespace {

using namespace ignis;

struct Options {
  std::string port;
  int led_mode = 0;
  bool led_on = false;
  DecodeFiles decode;
  MountCheckOptions mount;
};

struct Commands {
  CLI::App* standby = nullptr;
  CLI::App* normal = nullptr;
  CLI::App* version = nullptr;
  CLI::App* led = nullptr;
  CLI::App* decode = nullptr;
  CLI::App* mount_check = nullptr;
};

Commands add_commands(CLI::App& app, Options& options) {
  Commands commands;
  app.require_subcommand(1);
  app.fallthrough();
  app.add_option("--port", options.port, "serial device, pty or udp://ADDRESS:PORT (default: driver.port)");
  commands.standby = app.add_subcommand("standby", "stop motors and laser; inertial data go on");
  commands.normal = app.add_subcommand("normal", "measure");
  commands.version = app.add_subcommand("version", "print the sensor's version texts");
  commands.led = app.add_subcommand("led", "set the light ring");
  commands.led->add_option("mode", options.led_mode, "1: all lights off (or on with --on); 2 to 8: built-in patterns")
      ->required()
      ->check(CLI::Range(1, static_cast<int>(l1::LedRing::kLastMode)));
  commands.led->add_flag("--on", options.led_on, "mode 1 with all lights on");

  commands.decode = app.add_subcommand("decode", "write the points and samples of a recording as tables");
  commands.decode->add_option("capture", options.decode.capture, "raw byte stream")->required();
  auto* points = commands.decode->add_option("-o,--points", options.decode.points,
                                             "CSV: scan, j, x, y, z, intensity; LiDAR frame");
  auto* imu = commands.decode->add_option("--imu", options.decode.imu, "CSV: packet_id, quaternion, rate, force");
  commands.decode->callback([points, imu] {
    if (points->empty() && imu->empty()) throw CLI::RequiredError("-o POINTS.csv or --imu IMU.csv");
  });

  commands.mount_check = app.add_subcommand("mount-check", "at rest: mount angles by gravity and floor, units, signs");
  commands.mount_check->add_option("--seconds", options.mount.seconds, "of data to look at")
      ->check(CLI::Range(1.0, 60.0))
      ->capture_default_str();
  commands.mount_check->add_option("--capture", options.mount.capture, "look at the start of this recording instead");
  return commands;
}

runtime::ExitCode run(const Commands& commands, const Options& options, const runtime::Application& application) {
  DriverConfig driver = application.config.driver;
  if (!options.port.empty()) driver.port = options.port;
  if (commands.decode->parsed()) return decode_capture(options.decode, driver);
  if (commands.mount_check->parsed()) return check_mount(options.mount, driver, application.config.extrinsics);
  SensorSession session(driver);
  if (commands.standby->parsed()) return set_working_mode(session, l1::WorkingMode::kStandby);
  if (commands.normal->parsed()) return set_working_mode(session, l1::WorkingMode::kNormal);
  if (commands.version->parsed()) return print_version(session);
  return set_led(session, options.led_mode, options.led_on);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  Commands commands;
  return runtime::run_application(
      "l1_tool", "Unitree L1: commands to the sensor, a look into recordings, a check of the mount", argc, argv,
      [&](CLI::App& app) { commands = add_commands(app, options); },
      [&](const runtime::Application& application) { return run(commands, options, application); });
}
