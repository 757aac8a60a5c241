// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace ignis::runtime {

/// What one subscription would not take, and whether that leaves it without anything. Values in, values out: time comes
/// with the calls [s of any steady clock].
class Refusals {
 public:
  /// [s] for which the last refusal is told after it happened.
  static constexpr double kTold_s = 3.0;

  /// Why a message is not of the type that the channel carries; empty when it is.
  [[nodiscard]] static std::string foreign_type(std::span<const std::byte> data, std::int64_t expected);

  void taken(double now_s) { last_taken_s_ = now_s; }

  /// A message was refused for this reason. True when it deserves a line in the log: the 1st, 2nd, 4th, 8th...
  bool refused(const std::string& reason, bool is_foreign, double now_s);

  [[nodiscard]] std::int64_t count() const { return count_; }

  /// The newest reason with the number of refusals, while it is new; else empty.
  [[nodiscard]] std::string trouble(double now_s) const;

  /// Whether somebody else's type is all that comes: then the channel is taken.
  [[nodiscard]] bool is_taken_by_another(double now_s) const;

 private:
  std::int64_t count_ = 0;
  std::string reason_;
  bool is_foreign_ = false;
  double last_refused_s_ = -kTold_s;
  double last_taken_s_ = -kTold_s;
};

}  // namespace ignis::runtime
