// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "common/keyframe.h"

namespace ignis::bench {

/// All keyframes in an LCM log of LIO_KEYFRAME, in the order of their arrival. Throws runtime::UserError when it holds
/// none.
[[nodiscard]] std::vector<Keyframe> read_keyframes(const std::filesystem::path& log);

}  // namespace ignis::bench
