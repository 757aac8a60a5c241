// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "runtime/application.h"

namespace ignis::runtime {

/// Publishes a recorded byte stream: at the sensor's pace on a live bus, as fast as possible into a log file. Stamps
/// come from the sensor's counters. What is damaged is told on the error stream and by kInputDamaged. Throws UserError
/// when the file is not what it should be.
[[nodiscard]] ExitCode play_capture(const Application& application, const std::string& path);

}  // namespace ignis::runtime
