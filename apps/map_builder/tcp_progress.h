// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace ignis {

/// How far the other end of a TCP connection takes what it is sent. A reader may be slow and yet alive: this is how we
/// see it.
struct TcpProgress {
  std::uint64_t acknowledged = 0;  ///< [bytes] so far
  bool is_complete = true;         ///< nothing waits for it; also when the system does not tell
};

[[nodiscard]] TcpProgress tcp_progress(int socket);

}  // namespace ignis
