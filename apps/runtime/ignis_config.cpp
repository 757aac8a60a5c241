// SPDX-License-Identifier: Apache-2.0
#include "runtime/ignis_config.h"

#include "common/fingerprint.h"

namespace ignis::runtime {

IgnisConfig load_config(const std::filesystem::path& file, const std::vector<std::string>& changes) {
  try {
    config::Json json = file.empty() ? config::Json::object() : config::read_json(file);
    config::Offences offences;
    for (const std::string& change : changes) config::assign(json, change, offences);
    return config::load<IgnisConfig>(json, std::move(offences));
  } catch (const config::ConfigError& error) {
    const std::string text = error.what();
    if (file.empty() || text.starts_with(file.string())) throw;
    throw config::ConfigError(file.string() + ": " + text);
  }
}

std::string print_config(const IgnisConfig& config) { return config::Printer::print(config).dump(2) + '\n'; }

std::string print_schema() {
  config::Json schema = config::SchemaWriter::schema(IgnisConfig{});
  schema["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  schema["title"] = "IGNIS LIO configuration";
  return schema.dump(2) + '\n';
}

std::string config_hash(const IgnisConfig& config) {
  Fingerprint fingerprint;
  fingerprint.add(std::string_view(print_config(config)));
  return fingerprint.text();
}

}  // namespace ignis::runtime
