// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/config_fields.h"

namespace ignis {

/// Thresholds of the reference's loop closer: the geometric candidate test and the scan-match confirmation. They share
/// the section `frontend` of the configuration with the filter's parameters, as in the reference's one table.
struct LoopGates {
  double loop_radius_m = 8.0;
  int loop_min_index_gap = 10;
  double loop_yaw_rad = 1.5707963267948966;
  double loop_max_correction_m = 2.0;
  double loop_match_min_frac = 0.3;
  double loop_max_mean_innovation = 0.04;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("loop_radius_m", self.loop_radius_m, {0.5, 100.0}, "m", "horizontal distance of a loop candidate");
    visit.integer("loop_min_index_gap", self.loop_min_index_gap, {1, 10000}, "keyframes",
                  "keyframes between the two ends of a loop");
    visit.number("loop_yaw_rad", self.loop_yaw_rad, {0.0, 3.14159265358979}, "rad",
                 "largest difference of heading of a loop candidate");
    visit.number("loop_max_correction_m", self.loop_max_correction_m, {0.01, 50.0}, "m",
                 "largest correction that a loop may ask for");
    visit.number("loop_match_min_frac", self.loop_match_min_frac, {0.01, 1.0}, "1",
                 "fraction of the points that must find a plane");
    visit.number("loop_max_mean_innovation", self.loop_max_mean_innovation, {0.001, 1.0}, "m",
                 "largest mean absolute point-to-plane distance after the match");
  }
};

}  // namespace ignis
