// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/lidar_config.h"

#include <format>

#include "common/config_json.h"

namespace ignis::sim {
namespace {

/// The keys whose values are not the defaults, or nothing.
template <class Section>
std::string changed_keys(const Section& section) {
  const config::Json used = config::Printer::print(section);
  const config::Json usual = config::Printer::print(Section{});
  std::string keys;
  for (const auto& [key, value] : used.items()) {
    if (value != usual.at(key)) keys += std::format("{}{}", keys.empty() ? "" : ", ", key);
  }
  return keys;
}

}  // namespace

void LidarConfig::check(config::Offences& offences, const std::string& path) const {
  l1.check(offences, path);
  const std::string unused = is_spinning() ? changed_keys(l1) : changed_keys(spinning);
  if (unused.empty()) return;
  const std::string allowed = is_spinning() ? "the model's own keys, in lidar.spinning"
                                            : "the keys of an L1; for a spinning LiDAR say model = \"spinning\"";
  offences.push_back({is_spinning() ? path : path + ".spinning", unused, allowed});
}

}  // namespace ignis::sim
