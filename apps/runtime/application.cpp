// SPDX-License-Identifier: Apache-2.0
#include "runtime/application.h"

#include <cstdlib>
#include <iostream>

#include "runtime/stop_signal.h"
#include "runtime/version.h"

namespace ignis::runtime {
namespace {

struct CommonOptions {
  std::string config_file;
  std::vector<std::string> changes;
  std::string lcm_url;
  bool print_config = false;
  bool print_schema = false;
};

void add_common_options(CLI::App& app, CommonOptions& options) {
  app.add_option("--config", options.config_file, "configuration file (default: built-in defaults)");
  app.add_option("--set", options.changes, "section.key=value: wins over the configuration file; may be repeated")
      ->allow_extra_args(false);
  app.add_option("--lcm-url", options.lcm_url, "LCM URL (default: LCM_DEFAULT_URL, then lcm.url of the configuration)");
  app.add_flag("--print-config", options.print_config, "print the effective configuration and end");
  app.add_flag("--print-schema", options.print_schema, "print the JSON schema of the configuration and end");
  app.set_version_flag("--version", build());
}

IgnisConfig effective_config(const CommonOptions& options) {
  IgnisConfig config = load_config(options.config_file, options.changes);
  if (!options.lcm_url.empty()) {
    config.lcm.url = options.lcm_url;
  } else if (const char* environment = std::getenv("LCM_DEFAULT_URL"); environment != nullptr && *environment != '\0') {
    config.lcm.url = environment;
  }
  return config;
}

}  // namespace

int run_application(const std::string& name, const std::string& description, int argc, char** argv,
                    const std::function<void(CLI::App&)>& add_options,
                    const std::function<ExitCode(const Application&)>& body) {
  CLI::App app(description, name);
  CommonOptions options;
  add_common_options(app, options);
  add_options(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kBadArguments;
  }
  try {
    if (options.print_schema) {
      std::cout << print_schema();
      return kDone;
    }
    Application application{.name = name, .config = effective_config(options), .config_hash = {}};
    application.config_hash = config_hash(application.config);
    if (options.print_config) {
      std::cout << print_config(application.config);
      return kDone;
    }
    catch_stop_signals();
    return body(application);
  } catch (const UserError& error) {
    std::cerr << name << ": " << error.what() << '\n';
    return error.code();
  } catch (const config::ConfigError& error) {
    std::cerr << name << ": " << error.what() << '\n';
    return kBadArguments;
  } catch (const std::exception& error) {
    std::cerr << name << ": " << error.what() << '\n';
    return kFailed;
  }
}

}  // namespace ignis::runtime
