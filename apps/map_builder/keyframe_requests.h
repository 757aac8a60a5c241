// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>

namespace ignis {

/// How often each missing keyframe has been asked for. The front end keeps a ring: what has not come after a few
/// requests is no longer there, and is given up.
class KeyframeRequests {
 public:
  static constexpr int kMost = 5;

  /// Whether to ask for it now, which then counts as done.
  [[nodiscard]] bool allow(std::int32_t id) {
    int& asked = asked_[id];
    if (asked > kMost) return false;
    if (++asked <= kMost) return true;
    ++given_up_;
    return false;
  }

  /// Another drive: its keyframes have the same numbers.
  void begin_session() { asked_.clear(); }

  /// Keyframes of all sessions.
  [[nodiscard]] std::int64_t given_up() const { return given_up_; }

 private:
  std::map<std::int32_t, int> asked_;
  std::int64_t given_up_ = 0;
};

}  // namespace ignis
