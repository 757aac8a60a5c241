// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "drivers/sim/scene_config.h"

namespace ignis {

/// What was loaded, as JSON: how many solids, the drive's length and duration, and all settings in use.
[[nodiscard]] std::string summary(const sim::SceneConfig& scene);

}  // namespace ignis
