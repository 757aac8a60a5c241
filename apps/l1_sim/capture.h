// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "drivers/sim/byte_faults.h"
#include "runtime/application.h"

namespace ignis {

struct OutputFiles {
  std::filesystem::path bytes;         ///< what the host would have received
  std::filesystem::path log;           ///< LCM log of what the driver makes of it, with the truth
  std::filesystem::path ground_truth;  ///< TUM, true pose at each inertial sample, t = 0 at the start; empty: none
};

/// Runs the whole stream into files, as fast as possible: into `bytes` or into `log`, whichever is named. All appear
/// only when complete; after Ctrl-C none does.
[[nodiscard]] runtime::ExitCode write_files(sim::L1Stream& stream, sim::ByteFaults& faults, const OutputFiles& files,
                                            const runtime::Application& application);

}  // namespace ignis
