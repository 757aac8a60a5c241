// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "drivers/sim/l1_beam.h"
#include "drivers/sim/spinning_beams.h"

namespace ignis::sim {

/// The LiDAR of a scene: an L1, whose keys stand in the section itself, or a spinning one with a section of its own.
struct LidarConfig {
  std::string model = "l1";
  L1BeamConfig l1;
  SpinningConfig spinning;

  void visit_fields(this auto& self, auto& visit) {
    visit.choice("model", self.model, {"l1", "spinning"}, "what the drive is seen by");
    self.l1.visit_fields(visit);
    visit.section("spinning", self.spinning, "the spinning LiDAR");
  }
  /// Refuses settings of the model that is not in use: they would be thought to matter.
  void check(config::Offences& offences, const std::string& path) const;

  [[nodiscard]] bool is_spinning() const { return model == "spinning"; }
};

}  // namespace ignis::sim
