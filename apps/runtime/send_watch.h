// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace ignis::runtime {

/// Whether what this process says gets onto the bus. HEALTH is the judge: while even that cannot be sent, nobody hears
/// the process. Values in, values out: time comes with the calls [s of any steady clock].
class SendWatch {
 public:
  /// [s] for which messages that could not be sent are told after the last one of them.
  static constexpr double kTold_s = 3.0;

  /// Takes the number of messages that could not be sent so far.
  void look(std::int64_t failed_sends, double now_s);

  /// HEALTH was sent, or it could not be. What the log should say of that; empty when all is as it was.
  std::string health_sent(bool sent, double now_s);

  /// Whether nothing can be sent.
  [[nodiscard]] bool is_mute() const { return mute_since_s_.has_value(); }

  /// What is lost, in words; empty when nothing is, or was not lately.
  [[nodiscard]] std::string trouble(double now_s) const;

 private:
  std::int64_t failed_sends_ = 0;
  double last_failed_s_ = -kTold_s;
  std::optional<double> mute_since_s_;
  std::string return_;  // what to say of the last time that nothing could be sent
};

}  // namespace ignis::runtime
