// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "replay_output.h"

namespace ignis {

/// What a person wants to know of a replay, in a few lines.
[[nodiscard]] std::string summary(const ReplaySource& source, const ReplayResult& result, const ReplayTiming& timing);

}  // namespace ignis
