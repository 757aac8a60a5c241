// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/surface_return.h"

#include <algorithm>
#include <cmath>

namespace ignis::sim {

double visible_range(double at_10_percent_m, double at_90_percent_m, double brightness) {
  const double growth = std::log(at_90_percent_m / at_10_percent_m) / std::log(9.0);
  return at_90_percent_m * std::pow(std::max(brightness, 0.0) / 0.9, growth);
}

std::uint8_t grey_value(double brightness) {
  return static_cast<std::uint8_t>(std::lround(20.0 + 235.0 * std::clamp(brightness, 0.0, 1.0)));
}

}  // namespace ignis::sim
