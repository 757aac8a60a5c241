// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <deque>
#include <format>
#include <string>
#include <utility>

namespace ignis {

/// How much of a channel was lost lately. A tenth costs hardly any accuracy; where more than a sixth goes astray,
/// beyond what chance makes of less, a network or a computer is at its end, and what comes next is not known. It is
/// told until little is lost any more, so that it does not come and go.
class LossWatch {
 public:
  explicit LossWatch(std::string channel) : channel_(std::move(channel)) {}

  /// Takes the counts so far, at `now_s` of a clock that nobody sets. `heard`: without repeats, of which a network that
  /// doubles messages has as many as it likes.
  void look(double now_s, std::int64_t heard, std::int64_t lost) {
    if (!looks_.empty() && now_s - looks_.back().at_s < kStep_s) return;
    // More than any sensor sends: another sender with other numbers, or a jump in a log. Nothing is known of losses.
    if (lost - counted_ > kMostAtOnce) looks_.clear();
    counted_ = lost;
    looks_.push_back({now_s, heard, lost});
    while (looks_.size() > 2 && looks_[1].at_s <= now_s - kLately_s) looks_.pop_front();
    judge();
  }

  /// What to tell, as of the newest look; empty when few enough were lost.
  [[nodiscard]] std::string trouble() const {
    return is_trouble_ ? std::format("{}: {} of the last {} lost", channel_, lost_, sent_) : std::string();
  }

 private:
  static constexpr double kStep_s = 0.25;
  static constexpr double kLately_s = 5.0;
  static constexpr double kMaxShare = 0.15;
  static constexpr double kShareToEnd = 0.08;
  static constexpr double kFewLost = 5.0;
  static constexpr std::int64_t kMostAtOnce = 5000;

  struct Look {
    double at_s;
    std::int64_t heard;
    std::int64_t lost;
  };

  void judge() {
    lost_ = looks_.back().lost - looks_.front().lost;
    sent_ = looks_.back().heard - looks_.front().heard + lost_;
    const auto lost = static_cast<double>(lost_);
    const auto sent = static_cast<double>(sent_);
    is_trouble_ =
        is_trouble_ ? lost > kShareToEnd * sent : lost >= kFewLost && lost > kMaxShare * sent + std::sqrt(sent);
  }

  std::string channel_;
  std::deque<Look> looks_;
  std::int64_t counted_ = 0;
  std::int64_t lost_ = 0;
  std::int64_t sent_ = 0;
  bool is_trouble_ = false;
};

}  // namespace ignis
