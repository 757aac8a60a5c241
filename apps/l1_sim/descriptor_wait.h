// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "host_line.h"

namespace ignis {

/// Waits until `descriptor` has bytes (true), or `deadline` has passed or a signal came (false). A line whose other end
/// is closed counts as one without bytes. A deadline in the past only looks.
[[nodiscard]] bool wait_for_input(int descriptor, HostLine::Clock::time_point deadline);

}  // namespace ignis
