// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "common/time.h"

namespace ignis::runtime {

/// [us] of a clock that nobody sets.
inline Utime steady_now() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// Wall time that a step of the system's clock does not disturb: read once, then carried by the steady clock.
class HostClock {
 public:
  [[nodiscard]] Utime now() const { return offset_ + steady_now(); }

 private:
  Utime offset_ =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
          .count() -
      steady_now();
};

}  // namespace ignis::runtime
