// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "runtime/health_config.h"
#include "runtime/process_usage.h"

namespace ignis::runtime {

/// Holds what a process uses against its declared limits. Values in, values out: time comes with the samples.
class BudgetWatch {
 public:
  /// A limit must be exceeded in so many samples in a row: a rebuild of the map may take a second.
  static constexpr int kPatience = 5;

  explicit BudgetWatch(std::optional<ProcessLimits> limits) : limits_(limits) {}

  /// One message was handled `latency_ms` after it had arrived. Nonsense, as after a step of the clock, is left out.
  void add_latency(double latency_ms);

  /// Ends a period at `now_s` [s of any steady clock].
  void sample(double now_s, const ProcessUsage& usage);

  /// Of the last period.
  [[nodiscard]] double cpu_percent() const { return cpu_percent_; }
  [[nodiscard]] double memory_mb() const { return memory_mb_; }
  [[nodiscard]] double latency_ms() const { return latency_ms_; }

  [[nodiscard]] const std::optional<ProcessLimits>& limits() const { return limits_; }

  /// What has been beyond its limit for kPatience periods, in words; empty when all is well.
  [[nodiscard]] std::string trouble() const;

 private:
  std::optional<ProcessLimits> limits_;
  std::optional<double> last_s_;
  double last_cpu_s_ = 0.0;
  double worst_latency_ms_ = 0.0;
  double cpu_percent_ = 0.0;
  double memory_mb_ = 0.0;
  double latency_ms_ = 0.0;
  int cpu_beyond_ = 0;  // periods in a row
  int memory_beyond_ = 0;
  int latency_beyond_ = 0;
};

}  // namespace ignis::runtime
