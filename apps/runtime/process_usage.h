// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ignis::runtime {

/// What this process has used so far.
struct ProcessUsage {
  double cpu_s = 0.0;      ///< [s] user and system time of all threads
  double memory_mb = 0.0;  ///< [MB] resident; 0 where the system does not tell
};

/// Asks the kernel (getrusage, /proc/self/statm).
[[nodiscard]] ProcessUsage process_usage();

}  // namespace ignis::runtime
