// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "capture.h"
#include "drivers/sim/spinning_stream.h"

namespace ignis {

/// Runs the whole stream of a spinning LiDAR into `files.log`, and the truth into `files.ground_truth` if named, as
/// fast as possible. All appear only when complete; after Ctrl-C none does.
[[nodiscard]] runtime::ExitCode write_spinning_log(sim::SpinningStream& stream, const OutputFiles& files,
                                                   const runtime::Application& application);

}  // namespace ignis
