// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "backend/keyframe_pose.h"
#include "ignis/graph_command_t.hpp"

namespace ignis {

/// Whether it is one of those that graph_command_t knows.
[[nodiscard]] bool is_known(const graph_command_t& command);

/// Whether the graph holds both keyframes that the command names. `keyframes`: all of the graph, ascending ids.
[[nodiscard]] bool names_keyframes_of(std::span<const KeyframePose> keyframes, const graph_command_t& command);

}  // namespace ignis
