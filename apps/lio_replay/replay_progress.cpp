// SPDX-License-Identifier: Apache-2.0
#include "replay_progress.h"

#include <algorithm>
#include <format>
#include <iostream>

#include <unistd.h>

namespace ignis {
namespace {

constexpr int kBarWidth = 30;
constexpr std::chrono::milliseconds kRefresh{100};

std::string bar(int percent) {
  const int filled = kBarWidth * percent / 100;
  return std::string(static_cast<std::size_t>(filled), '#') +
         std::string(static_cast<std::size_t>(kBarWidth - filled), '.');
}

}  // namespace

ReplayProgress::ReplayProgress(Utime first, Utime last)
    : first_(first), last_(std::max(first, last)), terminal_(isatty(STDERR_FILENO) != 0) {}

void ReplayProgress::show(Utime utime) {
  const double total = seconds_between(first_, last_);
  const double done = std::clamp(seconds_between(first_, utime), 0.0, total);
  const int percent = total > 0.0 ? static_cast<int>(100.0 * done / total) : 100;
  const auto now = std::chrono::steady_clock::now();
  const bool due =
      terminal_ ? now - shown_ >= kRefresh || (percent >= 100 && shown_percent_ < 100) : percent >= shown_percent_ + 10;
  if (!due) return;
  const bool ended = shown_percent_ >= 100;
  shown_percent_ = percent;
  shown_ = now;
  if (ended) return;
  const double spent = std::chrono::duration<double>(now - began_).count();
  const double left = done > 0.0 ? spent * (total - done) / done : 0.0;
  std::cerr << std::format("{}replay [{}] {:3d} %  {:.1f} of {:.1f} s, {:.1f} times real time, {:.0f} s left{}",
                           terminal_ ? "\r" : "", bar(percent), percent, done, total, done / std::max(spent, 1e-9),
                           left, terminal_ && percent < 100 ? "   " : "\n");
  std::cerr.flush();
}

}  // namespace ignis
