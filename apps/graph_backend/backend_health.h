// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "backend/smoother.h"

namespace ignis {

/// What the back end knows of its own work.
struct BackendSituation {
  SmootherStats graph;
  std::string refusal;                      ///< why the newest keyframe was refused; empty when it was not
  std::string journal_failure;              ///< why changes are not on disk; empty while they are
  std::optional<std::int32_t> waiting_for;  ///< keyframe without which those behind it stay out of the graph
  std::int64_t keyframes_given_up = 0;
  bool gave_up_lately = false;         ///< on a keyframe
  bool missed_a_cloud_lately = false;  ///< since the journal did not give it back
};

struct BackendHealth {
  std::int8_t state = 0;  ///< one of health_t's constants
  std::string text;       ///< for people
};

/// The worst of it: what ends the graph before what costs a keyframe before what costs a loop.
[[nodiscard]] BackendHealth health_of(const BackendSituation& situation);

}  // namespace ignis
