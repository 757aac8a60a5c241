// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "common/config_fields.h"

namespace ignis::runtime {

/// What one process may use. Beyond it, several seconds in a row, its state is DEGRADED and says why.
struct ProcessLimits {
  double cpu_percent = 0.0;
  double memory_mb = 0.0;
  double latency_ms = 0.0;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("cpu_percent", self.cpu_percent, {1.0, 10000.0}, "% of one core", "processor time, over a second");
    visit.number("memory_mb", self.memory_mb, {1.0, 1e6}, "MB", "resident memory");
    visit.number("latency_ms", self.latency_ms, {1.0, 60000.0}, "ms",
                 "longest time from the arrival of a message to the end of its handling");
  }
};

/// Section `health`. The defaults are several times what the processes need on a 2-core machine (docs/vehicle.md).
struct HealthConfig {
  ProcessLimits l1_driver{.cpu_percent = 30.0, .memory_mb = 100.0, .latency_ms = 500.0};
  ProcessLimits lio_frontend{.cpu_percent = 90.0, .memory_mb = 400.0, .latency_ms = 500.0};
  ProcessLimits graph_backend{.cpu_percent = 150.0, .memory_mb = 1000.0, .latency_ms = 3000.0};
  ProcessLimits map_builder{.cpu_percent = 150.0, .memory_mb = 1500.0, .latency_ms = 1500.0};

  void visit_fields(this auto& self, auto& visit) {
    visit.section("l1_driver", self.l1_driver, "limits of l1_driver");
    visit.section("lio_frontend", self.lio_frontend, "limits of lio_frontend");
    visit.section("graph_backend", self.graph_backend, "limits of graph_backend");
    visit.section("map_builder", self.map_builder, "limits of map_builder");
  }

  /// Limits of a process by its name; nothing for those that have none, such as the simulator.
  [[nodiscard]] std::optional<ProcessLimits> limits_of(std::string_view process) const {
    if (process == "l1_driver") return l1_driver;
    if (process == "lio_frontend") return lio_frontend;
    if (process == "graph_backend") return graph_backend;
    if (process == "map_builder") return map_builder;
    return std::nullopt;
  }
};

}  // namespace ignis::runtime
