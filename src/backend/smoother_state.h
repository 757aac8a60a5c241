// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/unordered/unordered_flat_map.hpp>
#include <deque>
#include <vector>

#include "backend/factors/information.h"
#include "backend/factors/keyframe_factors.h"
#include "backend/factors/motion_factor.h"
#include "backend/journal/cloud_store.h"
#include "backend/keyframe_pose.h"
#include "backend/keyframes/odometry_chain.h"
#include "backend/loops/loop_result.h"
#include "backend/loops/place_index.h"
#include "backend/smoother.h"

namespace ignis {

/// A keyframe in the graph.
struct GraphNode {
  LinkEnd end;
  WhiteningRows odometry;                       ///< of the link to the previous node, for the exported graph
  Matrix6d pose_covariance = Matrix6d::Zero();  ///< the front end's, of T_odom_body; attitude then position, body axes
};

/// A loop that the match has verified.
struct GraphLoop {
  LoopResult result;    ///< with stage, reason and figures as last published
  FactorId factor = 0;  ///< while it is in the graph
  WhiteningRows rows;
  std::int32_t number = 0;       ///< 0, 1, 2 ... in the order of their arrival
  std::int32_t entered_id = -1;  ///< newest keyframe when it entered the graph
  bool is_contradicted = false;  ///< by the graph, and so waits for others to stand with
};

/// A pair of keyframes that must not be closed.
struct LoopVeto {
  std::int32_t from_id = 0;
  std::int32_t to_id = 0;

  bool operator==(const LoopVeto&) const = default;
};

/// Keyframes that retired at once.
struct RetiredBlock {
  std::size_t until = 0;                   ///< place of the first keyframe behind it
  Matrix6d covariance = Matrix6d::Zero();  ///< of its keyframes as one: attitude then position, in axes of map
};

/// Keyframes that are estimated no more (keyframe_retirement.h).
struct RetiredKeyframes {
  std::vector<RetiredBlock> blocks;  ///< in the order of their keyframes
  Motion newest_motion;              ///< of the newest of them: velocity and biases are not taken for known
  std::vector<GraphLoop> loops;      ///< that were in the graph between them

  [[nodiscard]] std::size_t count() const { return blocks.empty() ? 0 : blocks.back().until; }
};

/// All that the smoother knows besides the solver's factors and values. Plain data; the functions that change it stand
/// in keyframe_chain.h, keyframe_retirement.h, loop_*.h and revision_report.h. The vectors of one element per node
/// share their indices.
struct SmootherState {
  std::vector<GraphNode> nodes;
  RetiredKeyframes retired;            ///< the oldest of them
  std::deque<KeyframeLink> links;      ///< of the others: what their factors are made of
  CloudStore clouds;                   ///< body frame, one per node
  std::vector<KeyframePose> poses;     ///< as the graph places them, one per node
  std::vector<Pose> published;         ///< as last listed in an update
  std::vector<KeyframePose> absorbed;  ///< keyframes without a node: where they stay; ascending (keyframe_thinning.h)
  std::vector<GraphLoop> loops;        ///< in the graph
  std::vector<GraphLoop> waiting;      ///< verified, but outside of it
  std::vector<LoopVeto> vetoes;
  SmootherStats stats;
  Eigen::Vector3d angular_rate = Eigen::Vector3d::Zero();
  std::int32_t session = 0;
  std::int32_t expected_id = 0;
  std::int32_t last_loop_id = -1;
  std::int32_t next_loop_number = 0;
  std::int32_t revision = 0;
  int absorbed_loops = 0;  ///< loops that went with absorbed keyframes

  // What follows from the above; brought up to date by follow_nodes().
  PlaceIndex places{kPlaceCell};
  OdometryChain odometry;
  boost::unordered_flat_map<std::uint64_t, bool> agreement;  ///< of pairs of loop numbers that were compared

  static constexpr double kPlaceCell = 8.0;  // [m] about the radius of the candidate test

  [[nodiscard]] const GraphNode* node_of(std::int32_t id) const;
  /// Index of a keyframe that the graph holds.
  [[nodiscard]] std::size_t place_of(std::int32_t id) const;
};

/// How many the graph has taken, absorbed ones among them.
[[nodiscard]] int keyframes_in(const SmootherState& state);

/// Whether the graph knows the keyframe by its pose alone.
[[nodiscard]] bool is_absorbed(std::int32_t id, const SmootherState& state);

/// Whether any keyframe between these two ids is known by its pose alone.
[[nodiscard]] bool were_absorbed_between(std::int32_t earlier, std::int32_t later, const SmootherState& state);

/// Whether a keyframe, which the graph has taken, is estimated no more.
[[nodiscard]] bool has_retired(std::int32_t id, const SmootherState& state);

/// Brings what follows from nodes and poses up to date.
void follow_nodes(SmootherState& state, const BackendConfig& config);

}  // namespace ignis
