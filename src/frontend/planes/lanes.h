// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

/// Four single-precision numbers side by side: one vector register of any 64-bit x86 or ARM, without an architecture
/// flag and without intrinsics.
namespace ignis {

using Lanes = float __attribute__((vector_size(16)));
using LaneMask = std::int32_t __attribute__((vector_size(16)));  ///< -1 or 0 each

inline constexpr int kLanes = 4;

[[nodiscard]] inline Lanes all(float value) { return Lanes{value, value, value, value}; }

[[nodiscard]] inline bool any(LaneMask mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }

[[nodiscard]] inline Lanes square_root(Lanes values) {
  for (int k = 0; k < kLanes; ++k) values[k] = std::sqrt(values[k]);
  return values;
}

/// Lane k is the sum over the lanes of the k-th argument.
[[nodiscard]] inline Lanes sums_of(Lanes a, Lanes b, Lanes c, Lanes d) {
  const Lanes ab_even = __builtin_shufflevector(a, b, 0, 2, 4, 6);
  const Lanes ab_odd = __builtin_shufflevector(a, b, 1, 3, 5, 7);
  const Lanes cd_even = __builtin_shufflevector(c, d, 0, 2, 4, 6);
  const Lanes cd_odd = __builtin_shufflevector(c, d, 1, 3, 5, 7);
  const Lanes ab = ab_even + ab_odd;  // (a0 + a1, a2 + a3, b0 + b1, b2 + b3)
  const Lanes cd = cd_even + cd_odd;
  return __builtin_shufflevector(ab, cd, 0, 2, 4, 6) + __builtin_shufflevector(ab, cd, 1, 3, 5, 7);
}

}  // namespace ignis
