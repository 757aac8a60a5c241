// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "backend/smoother.h"
#include "common/time.h"
#include "ignis/keyframe_t.hpp"

namespace ignis {

/// Hears what the processes would publish of keyframes and graph, in their order.
class GraphListener {
 public:
  virtual ~GraphListener() = default;

  /// A part of a keyframe leaves the front end; `sequence` is the sender's.
  virtual void keyframe_sent(const keyframe_t& part) = 0;

  /// The back end publishes what an update changed. `utime` [us] is the stamp of the graph's newest keyframe.
  virtual void graph_changed(const Smoother& smoother, const SmootherUpdate& update, std::int32_t session,
                             Utime utime) = 0;
};

}  // namespace ignis
