// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace ignis {

/// Running 64-bit FNV-1a hash (Fowler, Noll, Vo). For comparing results and configurations, not for security.
class Fingerprint {
 public:
  void add(std::string_view bytes);
  void add(std::int64_t value);
  void add(double value) { add(std::bit_cast<std::int64_t>(value)); }

  /// Sixteen hexadecimal digits.
  [[nodiscard]] std::string text() const;

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ULL;
};

}  // namespace ignis
