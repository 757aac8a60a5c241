// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "replay_input.h"
#include "replay_result.h"
#include "runtime/application.h"

namespace ignis {

/// What graph and map did not take of what the front end gave them, for people; empty when they took everything.
[[nodiscard]] std::string refusals(const ReplayResult& result);

/// How a replay ends whose results are written: kDone only when they are all that the log allows and the log holds all
/// that was measured. Throws runtime::UserError where they are none, or end before the drive does.
[[nodiscard]] runtime::ExitCode verdict(const ReplayResult& result, const LogInventory& inventory, bool stopped);

}  // namespace ignis
