// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace ignis::sim {

/// A number that carries its first and second derivative by time, so that rates and accelerations of composed motions
/// are exact. Rules: product, chain and quotient rule of calculus, nothing else.
struct Jet {
  double value = 0.0;
  double rate = 0.0;          ///< first derivative [1/s]
  double acceleration = 0.0;  ///< second derivative [1/s^2]
};

/// f(x) from f, f', f'' at x.value.
[[nodiscard]] inline Jet chain(const Jet& x, double f, double df, double ddf) {
  return {f, df * x.rate, ddf * x.rate * x.rate + df * x.acceleration};
}

[[nodiscard]] inline Jet operator+(const Jet& a, const Jet& b) {
  return {a.value + b.value, a.rate + b.rate, a.acceleration + b.acceleration};
}
[[nodiscard]] inline Jet operator-(const Jet& a) { return {-a.value, -a.rate, -a.acceleration}; }
[[nodiscard]] inline Jet operator-(const Jet& a, const Jet& b) { return a + (-b); }
[[nodiscard]] inline Jet operator*(const Jet& a, const Jet& b) {
  return {a.value * b.value, a.rate * b.value + a.value * b.rate,
          a.acceleration * b.value + 2.0 * a.rate * b.rate + a.value * b.acceleration};
}
[[nodiscard]] inline Jet operator*(double a, const Jet& b) { return {a * b.value, a * b.rate, a * b.acceleration}; }
[[nodiscard]] inline Jet operator/(const Jet& a, const Jet& b) {
  const double inverse = 1.0 / b.value;
  return a * chain(b, inverse, -inverse * inverse, 2.0 * inverse * inverse * inverse);
}
[[nodiscard]] inline Jet sqrt(const Jet& x) {
  const double root = std::sqrt(x.value);
  return chain(x, root, 0.5 / root, -0.25 / (root * x.value));
}
[[nodiscard]] inline Jet sin(const Jet& x) {
  const double s = std::sin(x.value);
  return chain(x, s, std::cos(x.value), -s);
}
[[nodiscard]] inline Jet cos(const Jet& x) {
  const double c = std::cos(x.value);
  return chain(x, c, -std::sin(x.value), -c);
}

/// The derivatives do not care which quadrant the angle is in, only how (x, y) turns.
[[nodiscard]] inline Jet atan2(const Jet& y, const Jet& x) {
  const double norm2 = x.value * x.value + y.value * y.value;
  const double turn = x.value * y.rate - y.value * x.rate;
  const double turn_rate = x.value * y.acceleration - y.value * x.acceleration;
  const double norm2_rate = 2.0 * (x.value * x.rate + y.value * y.rate);
  return {std::atan2(y.value, x.value), turn / norm2, (turn_rate - turn * norm2_rate / norm2) / norm2};
}

/// The rate as a quantity of its own; its second derivative is not known and reads zero.
[[nodiscard]] inline Jet rate_of(const Jet& x) { return {x.rate, x.acceleration, 0.0}; }

}  // namespace ignis::sim
