// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "frontend/lio.h"
#include "ignis/lio_command_t.hpp"

namespace ignis::messages {

/// Does what the command says. Why not, for people; empty when it will be done.
[[nodiscard]] inline const char* carry_out(const lio_command_t& command, Lio& lio) {
  if (command.command != lio_command_t::BEGIN_ANEW) return "there is no such command";
  return lio.begin_anew_after(command.utime, command.session);
}

}  // namespace ignis::messages
