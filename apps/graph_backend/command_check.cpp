// SPDX-License-Identifier: Apache-2.0
#include "command_check.h"

#include <algorithm>

namespace ignis {

bool is_known(const graph_command_t& command) {
  switch (command.command) {
    case graph_command_t::WITHDRAW_LOOP:
    case graph_command_t::VETO_LOOP:
    case graph_command_t::SEND_FULL_SET:
      return true;
    default:
      return false;
  }
}

bool names_keyframes_of(std::span<const KeyframePose> keyframes, const graph_command_t& command) {
  const auto holds = [&](std::int32_t id) { return std::ranges::binary_search(keyframes, id, {}, &KeyframePose::id); };
  return command.from_id != command.to_id && holds(command.from_id) && holds(command.to_id);
}

}  // namespace ignis
