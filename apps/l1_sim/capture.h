// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "drivers/sim/l1_stream.h"
#include "runtime/application.h"

namespace ignis {

struct CaptureFiles {
  std::filesystem::path bytes;         ///< what the sensor would have sent
  std::filesystem::path ground_truth;  ///< TUM, true pose at each inertial sample, t = 0 at the start; empty: none
};

/// Runs the whole stream into files, as fast as possible. Both appear only when complete; after Ctrl-C neither does.
[[nodiscard]] runtime::ExitCode write_capture(sim::L1Stream& stream, const CaptureFiles& files);

}  // namespace ignis
