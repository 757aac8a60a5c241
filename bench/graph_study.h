// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "backend/backend_config.h"
#include "backend/pose_graph/pose_graph_file.h"
#include "loop_liar.h"
#include "study_drive.h"

/// Published pose graphs as drives over which the back end's decision about loops is tried: edges from one pose to the
/// next are the odometry, all others the true loops.
namespace ignis::bench {

struct GraphStudy {
  StudyDrive drive;                  ///< without keyframes; T_world_body is the optimum of the graph
  std::vector<PoseGraphEdge> steps;  ///< from pose i to pose i + 1
  PoseGraph optimal;                 ///< the graph itself, its poses at the optimum
  /// [m] What the optimum itself is off by after alignment, if errors are as large as the edges say: root mean square
  /// over graphs with the same edges whose errors were drawn anew.
  double clean_ate_m = 0.0;
};

/// Of its first `poses`. `information_scale`: factor on the information of all edges, for graphs that claim far less or
/// more than is true. Throws std::runtime_error when the poses are not numbered 0, 1, 2 ... or a step is missing.
[[nodiscard]] GraphStudy graph_study(PoseGraph graph, std::size_t poses, double information_scale);

/// What became of a set of loops.
struct GraphOutcome {
  int true_tried = 0;
  int true_kept = 0;
  int false_tried = 0;  ///< wrong ones; those that the optimum, with what it knows, would take for true do not count
  int false_kept = 0;
  double from_clean_m = 0.0;  ///< distance from the optimum, root mean square after alignment
  /// Error over that of the optimum: what estimates lose by leaving measurements out is independent of the error of the
  /// best one, so squares add up.
  double ate_ratio = 1.0;
  double p99_ms = 0.0;  ///< processor time of a pose with its loops
};

/// Feeds poses and loops, each loop with its later pose, to the admission and trial of the back end.
[[nodiscard]] GraphOutcome judged(const GraphStudy& study, const std::vector<StudyLoop>& loops,
                                  const BackendConfig& config);

}  // namespace ignis::bench
