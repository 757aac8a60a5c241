// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// What a surface sends back to a LiDAR, of any model. `brightness` is reflectivity times the cosine of incidence
/// (Lambert).
namespace ignis::sim {

/// Farthest range [m] at which a surface still answers: grows with a power of the brightness through the ranges that a
/// data sheet gives for faced targets of 10 and of 90 percent.
[[nodiscard]] double visible_range(double at_10_percent_m, double at_90_percent_m, double brightness);

/// Grey value of a return, 20..255.
[[nodiscard]] std::uint8_t grey_value(double brightness);

}  // namespace ignis::sim
