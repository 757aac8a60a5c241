// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <tuple>
#include <vector>

#include "channel_agreement.h"
#include "graph_listener.h"
#include "ignis/loop_result_t.hpp"
#include "ignis/smoothed_keyframes_t.hpp"

namespace ignis {

/// How the smoothed side of a replay compares with the live run in the same log.
struct GraphAgreement {
  ChannelAgreement keyframes;        ///< parts of LIO_KEYFRAME
  ChannelAgreement revisions;        ///< parts of SMOOTHED_KEYFRAMES, of what moved and of full sets
  ChannelAgreement loops;            ///< LOOP_RESULT
  ChannelAgreement smoothed_states;  ///< SMOOTHED_STATE whose LIO_STATE was recorded as well

  [[nodiscard]] bool complete() const;
};

/// Compares what the live processes published with what the replay would publish, every field but the running number.
/// The full sets of the live back end leave by the clock, the states when they come: of both it is the content that
/// counts, given the revision that was the newest. LIO_STATE between two scans depends on when the scan arrived; a
/// recorded SMOOTHED_STATE has to be the recorded LIO_STATE, moved by one of the replay's corrections up to then.
class GraphComparison : public GraphListener {
 public:
  explicit GraphComparison(const RecordedResults& recorded);

  void keyframe_sent(const keyframe_t& part) override;
  void graph_changed(const Smoother& smoother, const SmootherUpdate& update, std::int32_t session,
                     Utime utime) override;

  /// Of what is stamped up to `until` [us].
  [[nodiscard]] GraphAgreement agreement(Utime until) const;

 private:
  using KeyframeKey = std::tuple<std::int32_t, std::int32_t, std::int16_t>;  // session, id, part
  using RevisionKey =
      std::tuple<std::int32_t, std::int32_t, std::int8_t, std::int16_t>;  // session, revision, full, part

  struct Correction {
    std::int32_t session = 0;
    Utime utime = 0;  // [us] of the newest keyframe in the graph
    Pose T_map_odom;
  };

  static KeyframeKey keyframe_key(const keyframe_t& part);
  static RevisionKey revision_key(const smoothed_keyframes_t& part);
  static std::int32_t loop_key(const loop_result_t& message);

  void compare_loop(const LoopResult& loop, std::int32_t session);
  [[nodiscard]] ChannelAgreement state_agreement(Utime until) const;
  [[nodiscard]] bool is_moved(std::span<const std::byte> smoothed, std::span<const std::byte> odometry) const;

  const RecordedResults& recorded_;
  RecordedChannel<keyframe_t, KeyframeKey> keyframes_;
  RecordedChannel<smoothed_keyframes_t, RevisionKey> revisions_;
  RecordedChannel<loop_result_t, std::int32_t> loops_;
  std::vector<Correction> corrections_;
  std::int32_t loop_results_ = 0;
};

}  // namespace ignis
