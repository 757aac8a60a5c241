// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "backend/pose_graph/pose_graph_file.h"

namespace ignis {

/// Poses from the edges alone, whatever the stored ones are: attitudes by the chordal relaxation, which has one optimum
/// (D. Martinec, T. Pajdla, "Robust rotation and translation estimation in multiview reconstruction", CVPR 2007;
/// L. Carlone et al., "Initialization techniques for 3D SLAM", ICRA 2015), then positions. The first vertex stays where
/// it is. In the order of the graph's vertices; empty when the edges do not determine all.
[[nodiscard]] std::vector<KeyframePose> chordal_start(const PoseGraph& graph);

/// The graph's poses with these attitudes, turned together so that the first vertex stays where it is, and the
/// positions that suit them best. Empty when the edges do not determine all, or without attitudes.
[[nodiscard]] std::vector<KeyframePose> with_positions(const PoseGraph& graph,
                                                       const std::vector<Eigen::Matrix3d>& attitudes);

}  // namespace ignis
