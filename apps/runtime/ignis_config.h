// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "backend/backend_config.h"
#include "common/config_json.h"
#include "common/extrinsics.h"
#include "common/loop_gates.h"
#include "drivers/driver_config.h"
#include "frontend/frontend_config.h"
#include "map/map_config.h"
#include "runtime/health_config.h"
#include "runtime/hmi_config.h"
#include "runtime/lcm_config.h"

namespace ignis::runtime {

/// Section `frontend`: the reference's one table, so the filter's parameters and the loop closer's gates together.
struct FrontendSection {
  FrontendConfig filter;
  LoopGates loop_gates;

  void visit_fields(this auto& self, auto& visit) {
    self.filter.visit_fields(visit);
    self.loop_gates.visit_fields(visit);
  }
  void check(config::Offences& offences, const std::string& path) const {
    if constexpr (requires { filter.check(offences, path); }) filter.check(offences, path);
  }
};

/// The whole configuration file. Every process reads the same one and uses its sections.
struct IgnisConfig {
  DriverConfig driver;
  Extrinsics extrinsics = l1_extrinsics();
  FrontendSection frontend;
  BackendConfig backend;
  MapConfig map;
  HmiConfig hmi;
  LcmConfig lcm;
  HealthConfig health;

  void visit_fields(this auto& self, auto& visit) {
    visit.section("driver", self.driver, "L1 driver");
    visit.section("extrinsics", self.extrinsics, "how the sensors sit on the vehicle");
    visit.section("frontend", self.frontend, "error-state Kalman filter, local map, gates, keyframes, loop gates");
    visit.section("backend", self.backend, "iSAM2 smoother and loop closing");
    visit.section("map", self.map, "three-level voxel map");
    visit.section("hmi", self.hmi, "browser view");
    visit.section("lcm", self.lcm, "message bus");
    visit.section("health", self.health, "what each process may use before it calls itself DEGRADED");
  }
  /// Filter and graph describe one inertial unit: gravity and noise densities must agree. Bias walks may differ, since
  /// the filter's also stands for what its linearisation leaves out.
  void check(config::Offences& offences, const std::string& path) const;
};

/// Reads, checks and returns a configuration; throws config::ConfigError with every offence. `changes` are assignments
/// "section.key=value" that win over the file; an empty file name stands for the built-in defaults.
[[nodiscard]] IgnisConfig load_config(const std::filesystem::path& file, const std::vector<std::string>& changes = {});

/// The effective configuration, as --print-config shows it.
[[nodiscard]] std::string print_config(const IgnisConfig& config);

/// JSON schema of the configuration file.
[[nodiscard]] std::string print_schema();

/// Fingerprint of the effective configuration: equal files give equal hashes whatever their layout.
[[nodiscard]] std::string config_hash(const IgnisConfig& config);

}  // namespace ignis::runtime
