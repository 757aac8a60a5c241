// SPDX-License-Identifier: Apache-2.0
#include "runtime/process_usage.h"

#include <fstream>

#include <sys/resource.h>
#include <unistd.h>

namespace ignis::runtime {
namespace {

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

}  // namespace

ProcessUsage process_usage() {
  ProcessUsage usage;
  rusage times{};
  if (getrusage(RUSAGE_SELF, &times) == 0) usage.cpu_s = seconds(times.ru_utime) + seconds(times.ru_stime);
  std::ifstream statm("/proc/self/statm");
  long total_pages = 0;
  long resident_pages = 0;
  if (statm >> total_pages >> resident_pages) {
    usage.memory_mb = 1e-6 * static_cast<double>(resident_pages) * static_cast<double>(sysconf(_SC_PAGESIZE));
  }
  return usage;
}

}  // namespace ignis::runtime
