// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "backend/smoother.h"

namespace ignis {

/// When the batch optimum beside the graph is begun and when it is taken over. Both are counted in keyframes, never in
/// time, so that the graph is a function of its inputs and their order: a replay takes the optimum over where the live
/// run did, however fast either computes. Whoever holds the graph solves in between, and waits when it has not
/// finished.
class ShadowSchedule {
 public:
  /// Call after every change of the graph.
  void note(const SmootherUpdate& update);

  /// A loop has entered or left since the last begin, and no solve is under way.
  [[nodiscard]] bool begin_due() const { return loops_changed_ && !pending(); }

  /// The graph was copied as it is now.
  void begin(const SmootherStats& graph);

  /// Between begin() and end().
  [[nodiscard]] bool pending() const { return due_at_ >= 0; }

  /// The optimum has to be taken over now, before the graph of so many keyframes gets its next one.
  [[nodiscard]] bool adoption_due(int keyframes) const { return pending() && keyframes >= due_at_; }

  /// The optimum was taken over, or dropped.
  void end() { due_at_ = -1; }

 private:
  bool loops_changed_ = false;
  int due_at_ = -1;  // keyframes in the graph
};

/// [keyframes] between copy and takeover: the more are estimated, the longer the solve, and none shall have to wait for
/// it.
[[nodiscard]] int shadow_delay(int estimated);

}  // namespace ignis
