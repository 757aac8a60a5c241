// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace ignis {

/// Bytes that the other end of a TCP connection has acknowledged so far; 0 when the system does not tell. A reader may
/// be slow and yet alive: this is how we see it.
[[nodiscard]] std::uint64_t bytes_acknowledged(int socket);

}  // namespace ignis
