// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "common/time.h"

namespace ignis {

/// A bar on the error stream with the time left: rewritten on a terminal, a line every tenth in a log.
class ReplayProgress {
 public:
  /// [us] of the first and the last measurement that will be replayed.
  ReplayProgress(Utime first, Utime last);

  void show(Utime utime);

 private:
  Utime first_;
  Utime last_;
  bool terminal_;
  int shown_percent_ = -100;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point shown_{};
};

}  // namespace ignis
