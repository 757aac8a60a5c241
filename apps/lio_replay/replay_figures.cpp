// SPDX-License-Identifier: Apache-2.0
#include "replay_figures.h"

#include <algorithm>

namespace ignis {

std::map<std::string, std::int64_t> scans_by_reason(const ReplayResult& result) {
  std::map<std::string, std::int64_t> reasons;
  for (const ScanStats& scan : result.scans) ++reasons[std::string(text(scan.reason))];
  return reasons;
}

std::int64_t applied_scans(const ReplayResult& result) {
  return std::ranges::count_if(result.scans, [](const ScanStats& scan) { return scan.applied(); });
}

double drive_seconds(const ReplayInput& input, const ReplayResult& result) {
  const Utime last = result.scans.empty() ? input.inventory().last_utime : result.scans.back().utime;
  return seconds_between(input.inventory().first_utime, last);
}

double quantile(std::vector<double> values, double ratio) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(ratio * static_cast<double>(values.size() - 1))];
}

}  // namespace ignis
