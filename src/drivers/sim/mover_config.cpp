// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/mover_config.h"

#include <format>

namespace ignis::sim {
namespace {

constexpr double kShortestLeg = 0.01;

Eigen::Vector3d to_vector(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

}  // namespace

void MoverConfig::check(config::Offences& offences, const std::string& path) const {
  if (waypoints.empty()) offences.push_back({path + ".waypoints", "0 entries", "one or more"});
  if (boxes.empty() && cylinders.empty() && spheres.empty()) {
    offences.push_back({path, "no solids", "at least one of boxes, cylinders, spheres"});
  }
  if (waypoints.size() < 2) return;
  const std::size_t legs = loop ? waypoints.size() : waypoints.size() - 1;
  for (std::size_t i = 0; i < legs; ++i) {
    const std::size_t next = (i + 1) % waypoints.size();
    if ((to_vector(waypoints[next].position_m) - to_vector(waypoints[i].position_m)).norm() >= kShortestLeg) continue;
    offences.push_back({std::format("{}.waypoints[{}].position_m", path, next), "the place of the one before",
                        std::format("at least {} m from it", kShortestLeg)});
  }
}

Mover to_mover(const MoverConfig& config) {
  std::vector<MoverStop> stops;
  for (const MoverWaypoint& waypoint : config.waypoints) {
    stops.push_back({to_vector(waypoint.position_m), waypoint.rest_s});
  }
  return {to_solids(config.boxes, config.cylinders, config.spheres), stops, config.speed_m_s, config.start_s,
          config.loop};
}

}  // namespace ignis::sim
