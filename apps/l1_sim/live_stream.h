// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "drivers/sim/l1_stream.h"
#include "runtime/application.h"

namespace ignis {

struct LiveOptions {
  std::filesystem::path link;  ///< name under which the serial port appears
  double wait_s = 30.0;        ///< [s] patience for a reader
};

/// Waits for a reader, then sends the stream in real time and the true pose on GROUND_TRUTH. Ends well after the last
/// byte was taken, or at Ctrl-C.
[[nodiscard]] runtime::ExitCode run_live(sim::L1Stream& stream, const LiveOptions& options,
                                         const runtime::Application& application);

}  // namespace ignis
