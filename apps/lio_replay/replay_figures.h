// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "replay_input.h"
#include "replay_result.h"

/// Figures that the report and the summary share.
namespace ignis {

/// How many scans left with each reason, in words.
[[nodiscard]] std::map<std::string, std::int64_t> scans_by_reason(const ReplayResult& result);

[[nodiscard]] std::int64_t applied_scans(const ReplayResult& result);

/// [s] from the first measurement to the last scan or, without any, to the end of the log.
[[nodiscard]] double drive_seconds(const ReplayInput& input, const ReplayResult& result);

/// The value that the share `ratio` (0 to 1) of the values does not exceed; 0 without any.
[[nodiscard]] double quantile(std::vector<double> values, double ratio);

}  // namespace ignis
