// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>

#include "runtime/ignis_config.h"

namespace ignis::runtime {

/// Exit codes of every executable.
enum ExitCode : int { kDone = 0, kFailed = 1, kBadArguments = 2, kInputDamaged = 3 };

/// Something that the user can mend: the message says what to do. Ends the process with the given code.
class UserError : public std::runtime_error {
 public:
  explicit UserError(const std::string& message, ExitCode code = kBadArguments)
      : std::runtime_error(message), code_(code) {}
  [[nodiscard]] ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

/// What an executable starts from.
struct Application {
  std::string name;
  IgnisConfig config;
  std::string config_hash;
};

/// The frame of every main: reads the command line (--config, --set, --lcm-url, --print-config, --print-schema,
/// --version and what `add_options` adds) and the configuration, catches stop signals, runs `body` and turns errors
/// into one line on the error stream and an exit code.
int run_application(const std::string& name, const std::string& description, int argc, char** argv,
                    const std::function<void(CLI::App&)>& add_options,
                    const std::function<ExitCode(const Application&)>& body);

}  // namespace ignis::runtime
