// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "common/nav_state.h"

namespace ignis {

/// Which states may be told, so that stamps of a session never go back, and which covariance goes with each.
///
/// A scan's state stands at the scan's end. When later inertial samples have been told already, it has corrected the
/// state of the next one, which then carries the scan's covariance.
class StateOrder {
 public:
  /// A scan's state: true when it is to be told. If not, its covariance is owed to the session's next sample.
  [[nodiscard]] bool take_scan(std::int32_t session, Utime utime, const Matrix15d& covariance) {
    const bool is_newest = told_until_ < std::pair(session, utime);
    if (is_newest) told_until_ = {session, utime};
    owed_ = is_newest ? std::nullopt : std::optional(Owed{session, covariance});
    return is_newest;
  }

  /// An inertial sample's state is told: the covariance that goes with it, if one is owed.
  [[nodiscard]] std::optional<Matrix15d> take_sample(std::int32_t session, Utime utime) {
    told_until_ = {session, utime};
    const std::optional<Owed> owed = std::exchange(owed_, std::nullopt);
    if (!owed || owed->session != session) return std::nullopt;
    return owed->covariance;
  }

 private:
  struct Owed {
    std::int32_t session;
    Matrix15d covariance;
  };

  std::pair<std::int32_t, Utime> told_until_{-1, 0};  // session and stamp
  std::optional<Owed> owed_;
};

}  // namespace ignis
