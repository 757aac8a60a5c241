// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>

namespace ignis::fuzz {

/// Stops the fuzzer when a property does not hold: unlike assert, also in optimised builds.
inline void require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace ignis::fuzz
