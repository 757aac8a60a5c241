// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/config_fields.h"

namespace ignis::sim {

/// How the device behaves beside measuring.
struct DeviceConfig {
  int id_modulus = 65536;
  double spin_up_s = 1.0;
  double power_cycle_at_s = 0.0;
  double power_off_s = 2.0;
  double ignore_commands = 0.0;
  bool announces_version = true;

  void visit_fields(this auto& self, auto& visit) {
    visit.integer("id_modulus", self.id_modulus, {2, 65536}, "ids", "scan and inertial ids count from 0 to one less");
    visit.number("spin_up_s", self.spin_up_s, {0.0, 60.0}, "s", "from the command to leave standby to the first scan");
    visit.number("power_cycle_at_s", self.power_cycle_at_s, {0.0, 1e6}, "s", "power fails at this instant; 0: never");
    visit.number("power_off_s", self.power_off_s, {0.0, 3600.0}, "s", "silence of a power cycle");
    visit.number("ignore_commands", self.ignore_commands, {0.0, 1.0}, "1",
                 "share of mode and LED commands that go unheard, as with real sensors");
    visit.flag("announces_version", self.announces_version, "VERSION goes out once unasked, for captures");
  }
};

}  // namespace ignis::sim
