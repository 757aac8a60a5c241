// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include <format>

#include "common/config_check.h"

namespace ignis {
namespace {

constexpr double kWaitS = 30.0;
constexpr double kLongestS = 1e6;
constexpr const char* kOutputs =
    "exactly one output: --capture FILE (the bytes), --log FILE (an LCM log of what the driver makes of them), --pty "
    "LINK (live, a serial port) or --udp HOST:PORT (live, datagrams)";

void refuse(config::Offences& offences, const std::string& option, const std::string& value,
            const std::string& allowed) {
  offences.push_back({option, value, allowed});
}

void check_outputs(const Options& options, config::Offences& offences) {
  std::string given;
  int count = 0;
  const auto note = [&](const char* name, bool is_given) {
    if (!is_given) return;
    given += std::format("{}{}", given.empty() ? "" : " ", name);
    ++count;
  };
  note("--capture", !options.files.bytes.empty());
  note("--log", !options.files.log.empty());
  note("--pty", !options.pty.empty());
  note("--udp", !options.udp.empty());
  if (count != 1) refuse(offences, "output", given.empty() ? "none" : given, kOutputs);
}

void check_seconds(const char* option, const std::optional<double>& value, config::Offences& offences) {
  if (value && !(*value > 0.0 && *value <= kLongestS)) {
    refuse(offences, option, std::format("{}", *value), std::format("more than 0, at most {} [s]", kLongestS));
  }
}

/// Options that say nothing about the chosen output are mistakes, not decoration.
void check_combinations(const Options& options, config::Offences& offences) {
  const auto only_with = [&](const char* option, bool is_given, bool fits, const char* allowed) {
    if (is_given && !fits) refuse(offences, option, "given", std::format("only with {}", allowed));
  };
  const sim::DeviceConfig usual;
  only_with("--wait", options.wait_s.has_value(), !options.pty.empty(), "--pty");
  only_with("--ground-truth", !options.files.ground_truth.empty(), !options.is_live(), "--capture or --log");
  only_with("--ignore-commands", options.device.ignore_commands != usual.ignore_commands, options.is_live(),
            "--pty or --udp: a file has no host");
  only_with("--spin-up", options.device.spin_up_s != usual.spin_up_s, options.is_live(),
            "--pty or --udp: a file has no host");
  only_with("--power-cycle-at", options.device.power_cycle_at_s > 0.0, options.files.log.empty(),
            "--pty, --udp or --capture: a log is stamped by the sensor's counters, which do not tell how long it was "
            "off");
}

}  // namespace

void add_options(CLI::App& app, Options& options) {
  app.add_option("--scene", options.scene, "scene file, such as config/scenes/battery_hall.json")->required();
  app.add_option("--seed", options.seed, "seed of all noise")->capture_default_str();
  app.add_option("--duration", options.duration_s, "end after this many seconds of sensor time");
  app.add_flag("--print-scene", options.print_scene, "print what the scene holds and end");

  app.add_option("--capture", options.files.bytes, "output: the bytes into this file, as fast as possible")
      ->group("Output (exactly one)");
  app.add_option("--log", options.files.log, "output: an LCM log for lio_replay, as fast as possible")
      ->group("Output (exactly one)");
  app.add_option("--pty", options.pty, "output: the bytes in real time on a pseudo-terminal of this name")
      ->group("Output (exactly one)");
  app.add_option("--udp", options.udp, "output: the bytes in real time as datagrams to HOST:PORT")
      ->group("Output (exactly one)");
  app.add_option("--ground-truth", options.files.ground_truth, "also write the true poses to this TUM file");
  app.add_option("--wait", options.wait_s,
                 std::format("seconds to wait for a reader of the pseudo-terminal (default {:.0f})", kWaitS));

  sim::DeviceConfig& device = options.device;
  app.add_option("--id-modulus", device.id_modulus, "scan and inertial ids wrap at this number")
      ->capture_default_str()
      ->group("Device");
  app.add_option("--power-cycle-at", device.power_cycle_at_s, "the power fails at this second; 0: never")
      ->capture_default_str()
      ->group("Device");
  app.add_option("--power-off", device.power_off_s, "seconds of silence of a power cycle")
      ->capture_default_str()
      ->group("Device");
  app.add_option("--spin-up", device.spin_up_s, "seconds from the end of standby to the first scan")
      ->capture_default_str()
      ->group("Device");
  app.add_option("--ignore-commands", device.ignore_commands, "share of mode and LED commands that go unheard")
      ->capture_default_str()
      ->group("Device");

  app.add_option("--fault", options.fault_texts,
                 "FAULT=RATE per frame, repeatable: drop, flip, cut, duplicate, stall, reorder, junk")
      ->allow_extra_args(false)
      ->group("Faults of the line");
  app.add_option("--stall-ms", options.faults.stall_ms, "length of a stall")
      ->capture_default_str()
      ->group("Faults of the line");
  app.add_option("--fault-seed", options.fault_seed, "seed of the faults")
      ->capture_default_str()
      ->group("Faults of the line");
  app.add_option("--fault-list", options.fault_list, "list the injected faults in this CSV file: offset, frame, fault")
      ->group("Faults of the line");
}

void require_log_only(const Options& options) {
  std::string given;
  const auto note = [&](const char* name, bool is_given) {
    if (is_given) given += std::format("{}{}", given.empty() ? "" : ", ", name);
  };
  const sim::DeviceConfig usual;
  note("--capture", !options.files.bytes.empty());
  note("--pty", !options.pty.empty());
  note("--udp", !options.udp.empty());
  note("--fault", !options.fault_texts.empty());
  note("--fault-list", !options.fault_list.empty());
  note("--id-modulus", options.device.id_modulus != usual.id_modulus);
  if (given.empty()) return;
  throw runtime::UserError(
      std::format("the scene {} has a spinning LiDAR, and only an L1 has bytes: {} cannot be used; write measurements "
                  "with --log FILE",
                  options.scene, given));
}

Options checked(Options options) {
  if (options.print_scene) return options;
  config::Offences offences;
  check_outputs(options, offences);
  check_combinations(options, offences);
  check_seconds("--duration", options.duration_s, offences);
  check_seconds("--wait", options.wait_s, offences);
  sim::read_fault_rates(options.fault_texts, options.faults, offences);
  config::Validator(offences, "fault").visit(options.faults);
  config::Validator(offences, "device").visit(options.device);
  if (!offences.empty()) {
    std::string text = "cannot run with these arguments:";
    for (const config::Offence& each : offences) {
      text += std::format("\n  {} = {}: allowed is {}", each.field, each.value, each.allowed);
    }
    throw runtime::UserError(text);
  }
  options.wait_s = options.wait_s.value_or(kWaitS);
  // A real sensor tells its version to who asks; a file has nobody who could.
  options.device.announces_version = !options.is_live();
  return options;
}

}  // namespace ignis
