// SPDX-License-Identifier: Apache-2.0
#include "drivers/counter_unwrapper.h"

#include <algorithm>
#include <cmath>

namespace ignis::l1 {

namespace {

/// A step back by so few, at once, is a frame that others have overtaken: no counter wraps that early, and no sensor
/// restarts that fast.
constexpr int kMostOvertaken = 8;

}  // namespace

std::int64_t CounterUnwrapper::advance(std::uint16_t id, double elapsed_us, double slack_us) {
  if (!last_id_) count_ = id;
  const int difference = last_id_ ? static_cast<int>(id) - static_cast<int>(*last_id_) : 0;
  guessed_ = false;
  if (difference < 0 && difference >= -kMostOvertaken && elapsed_us < kMostOvertaken * period_us_) return 0;
  last_id_ = id;
  if (difference == 0) return 0;
  const std::int64_t step = step_from(difference, elapsed_us, slack_us);
  count_ += step;
  return step;
}

std::int64_t CounterUnwrapper::step_from(int difference, double elapsed_us, double slack_us) {
  const auto plausible = [&](int step) { return step > 0 && step * period_us_ <= elapsed_us + slack_us; };
  if (plausible(difference)) return difference;
  if (plausible(difference + modulus_)) return difference + modulus_;
  guessed_ = true;
  const auto step = std::max<std::int64_t>(1, std::llround(elapsed_us / period_us_));
  // A step back with hardly any time lost shows the modulus; a longer one may as well be a restart of the sensor.
  if (difference < 0 && step == 1) modulus_ = 1 - difference;
  return step;
}

}  // namespace ignis::l1
