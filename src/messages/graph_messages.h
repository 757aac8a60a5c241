// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "backend/keyframe_pose.h"
#include "backend/loops/loop_result.h"
#include "common/nav_state.h"
#include "common/time.h"
#include "ignis/loop_result_t.hpp"
#include "ignis/smoothed_keyframes_t.hpp"
#include "ignis/state_t.hpp"
#include "messages/part_assembler.h"

/// SMOOTHED_KEYFRAMES, LOOP_RESULT and SMOOTHED_STATE. The sender sets `sequence`.
namespace ignis::messages {

/// One published state of the graph.
struct GraphRevision {
  Utime utime = 0;  ///< [us] of the newest keyframe
  std::int32_t session = 0;
  std::int32_t revision = 0;   ///< +1 per published state
  bool full = false;           ///< all keyframes are listed, not only those that moved
  std::int32_t keyframes = 0;  ///< in the graph
  std::int32_t newest_id = 0;
  Pose T_map_odom;
  Matrix6d covariance = Matrix6d::Zero();  ///< of the newest pose in map; attitude then position, body axes
  std::vector<KeyframePose> poses;
};

/// A revision as numbered parts of one datagram each; the sender sets one `sequence` for all of them.
[[nodiscard]] std::vector<smoothed_keyframes_t> to_messages(const GraphRevision& revision);

/// Puts the parts of revisions together again.
class RevisionAssembler {
 public:
  /// A complete revision, or nothing yet.
  [[nodiscard]] std::optional<GraphRevision> add(const smoothed_keyframes_t& part);
  [[nodiscard]] std::int64_t incomplete() const { return parts_.incomplete(); }

 private:
  PartAssembler<smoothed_keyframes_t> parts_;
};

/// A state of the filter, placed in map by the newest correction.
[[nodiscard]] state_t smoothed_state(NavState state, std::int32_t session, const Pose& T_map_odom);

[[nodiscard]] loop_result_t to_message(const LoopResult& result, std::int32_t session);

}  // namespace ignis::messages
