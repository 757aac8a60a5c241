// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

namespace ignis::l1 {

/// Turns a packet counter into a count that never wraps. The modulus of the L1's counters is not documented (wraps near
/// 1024 were seen on real units), so a step back is read as a wrap at a modulus seen before, at 65536, or else as the
/// number of periods that `elapsed` holds.
class CounterUnwrapper {
 public:
  explicit CounterUnwrapper(double period_us) : period_us_(period_us) {}

  /// Steps from the previous id to this one; 0 for a repeated id, for one that others have overtaken, and for
  /// the very first one.
  /// `elapsed_us`: about how much time passed since the previous id. `slack_us`: how far that may be too short.
  [[nodiscard]] std::int64_t advance(std::uint16_t id, double elapsed_us, double slack_us);

  /// Whether the latest step was taken from the elapsed time because the ids alone did not explain it.
  [[nodiscard]] bool guessed() const { return guessed_; }

  /// The first id plus all steps since.
  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] std::optional<std::uint16_t> last_id() const { return last_id_; }

 private:
  [[nodiscard]] std::int64_t step_from(int difference, double elapsed_us, double slack_us);

  double period_us_;
  std::optional<std::uint16_t> last_id_;
  int modulus_ = 65536;
  std::int64_t count_ = 0;
  bool guessed_ = false;
};

}  // namespace ignis::l1
