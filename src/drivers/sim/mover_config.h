// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/sim/mover.h"
#include "drivers/sim/solid_config.h"

namespace ignis::sim {

struct MoverWaypoint {
  std::array<double, 3> position_m = {0.0, 0.0, 0.0};
  double rest_s = 0.0;

  void visit_fields(this auto& self, auto& visit) {
    visit.vector("position_m", self.position_m, {-1000.0, 1000.0}, "m", "where the mover's own origin passes");
    visit.number("rest_s", self.rest_s, {0.0, 3600.0}, "s", "time to stand here before going on");
  }
};

/// Solids that move together, as a scene file describes them: places in the mover's own frame, -z forward.
struct MoverConfig {
  std::string name = {};
  double speed_m_s = 1.0;
  double start_s = 0.0;
  bool loop = true;
  std::vector<MoverWaypoint> waypoints = {};
  std::vector<BoxConfig> boxes = {};
  std::vector<CylinderConfig> cylinders = {};
  std::vector<SphereConfig> spheres = {};

  void visit_fields(this auto& self, auto& visit) {
    visit.text("name", self.name, "for people");
    visit.number("speed_m_s", self.speed_m_s, {0.01, 20.0}, "m/s", "speed between the waypoints");
    visit.number("start_s", self.start_s, {0.0, 3600.0}, "s", "stands at the first waypoint until then");
    visit.flag("loop", self.loop, "goes from the last waypoint to the first, again and again");
    visit.list("waypoints", self.waypoints, 1000, "straight legs, in order");
    visit.list("boxes", self.boxes, 100, "boxes, in the mover's own frame");
    visit.list("cylinders", self.cylinders, 100, "cylinders, in the mover's own frame");
    visit.list("spheres", self.spheres, 100, "spheres, in the mover's own frame");
  }
  void check(config::Offences& offences, const std::string& path) const;
};

[[nodiscard]] Mover to_mover(const MoverConfig& config);

}  // namespace ignis::sim
