// SPDX-License-Identifier: Apache-2.0
#include "runtime/ignis_config.h"

#include <array>
#include <format>

#include "common/fingerprint.h"

namespace ignis::runtime {

void IgnisConfig::check(config::Offences& offences, const std::string& path) const {
  struct Pair {
    const char* graph_field;
    double graph;
    const char* filter_field;
    double filter;
  };
  const FrontendConfig& filter = frontend.filter;
  const ImuNoise& graph = backend.imu;
  const std::array<Pair, 3> pairs{{{"gravity", graph.gravity, "gravity_m", filter.gravity_m},
                                   {"gyro_noise", graph.gyro_noise, "imu_noise_gyro", filter.imu_noise_gyro},
                                   {"accel_noise", graph.accel_noise, "imu_noise_accel", filter.imu_noise_accel}}};
  const std::string prefix = path.empty() ? "" : path + '.';
  for (const Pair& pair : pairs) {
    if (pair.graph == pair.filter) continue;
    offences.push_back({std::format("{}backend.imu.{}", prefix, pair.graph_field), std::format("{}", pair.graph),
                        std::format("the same as {}frontend.{}, {}: they describe one inertial unit", prefix,
                                    pair.filter_field, pair.filter)});
  }
}

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
