// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <format>
#include <string>
#include <utility>

namespace ignis {

/// How much of a channel was lost lately. A tenth costs hardly any accuracy; where a sixth goes astray a network or a
/// computer is at its end, and what comes next is not known.
class LossWatch {
 public:
  explicit LossWatch(std::string channel) : channel_(std::move(channel)) {}

  /// Takes the counts so far, at `now_s` of a clock that nobody sets.
  void look(double now_s, std::int64_t heard, std::int64_t lost) {
    if (!looks_.empty() && now_s - looks_.back().at_s < kStep_s) return;
    looks_.push_back({now_s, heard, lost});
    while (looks_.size() > 2 && looks_[1].at_s <= now_s - kLately_s) looks_.pop_front();
  }

  /// What to tell, as of the newest look; empty when few enough were lost.
  [[nodiscard]] std::string trouble() const {
    if (looks_.empty()) return {};
    const std::int64_t lost = looks_.back().lost - looks_.front().lost;
    const std::int64_t sent = looks_.back().heard - looks_.front().heard + lost;
    const double share = sent > 0 ? static_cast<double>(lost) / static_cast<double>(sent) : 0.0;
    if (lost < kFewLost || share <= kMaxShare) return {};
    return std::format("{}: {} of the last {} lost", channel_, lost, sent);
  }

 private:
  static constexpr double kStep_s = 0.25;
  static constexpr double kLately_s = 3.0;
  static constexpr double kMaxShare = 0.15;
  static constexpr std::int64_t kFewLost = 5;

  struct Look {
    double at_s;
    std::int64_t heard;
    std::int64_t lost;
  };

  std::string channel_;
  std::deque<Look> looks_;
};

}  // namespace ignis
