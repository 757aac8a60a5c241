// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <vector>

namespace ignis::bench {

/// Processor time of the process in all its threads: the same on a machine that others use too.
[[nodiscard]] inline double processor_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

/// Memory of the process that is in use.
[[nodiscard]] inline double resident_bytes() {
  double pages_in_all = 0.0;
  double resident = 0.0;
  std::ifstream("/proc/self/statm") >> pages_in_all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// The value below which the share of the values lies; 0 when there is none.
[[nodiscard]] inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace ignis::bench
