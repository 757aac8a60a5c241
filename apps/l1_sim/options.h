// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "capture.h"
#include "drivers/sim/device_config.h"

namespace ignis {

/// The command line of l1_sim.
struct Options {
  std::string scene;
  std::uint64_t seed = 1;
  std::optional<double> duration_s;
  bool print_scene = false;

  OutputFiles files;
  std::filesystem::path pty;  ///< name under which the serial port appears
  std::string udp;            ///< HOST:PORT
  std::optional<double> wait_s;

  sim::DeviceConfig device;
  std::vector<std::string> fault_texts;  ///< "drop=0.01"
  sim::FaultConfig faults;               ///< rates are read from fault_texts by checked()
  std::uint64_t fault_seed = 1;
  std::filesystem::path fault_list;

  [[nodiscard]] bool is_live() const { return !pty.empty() || !udp.empty(); }
};

void add_options(CLI::App& app, Options& options);

/// The options with everything filled in. Throws runtime::UserError that names every fault of the command line.
[[nodiscard]] Options checked(Options options);

/// For a scene whose LiDAR is no L1, so that there are no bytes to send or to spoil and no device to command. Throws
/// runtime::UserError that names every option that asks for one.
void require_log_only(const Options& options);

}  // namespace ignis
