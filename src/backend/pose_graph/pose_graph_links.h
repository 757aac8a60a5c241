// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "backend/pose_graph/pose_graph_file.h"

namespace ignis {

/// An edge between places in the graph's vertices, weighed alike in all directions: for starts, not for solutions.
struct PoseGraphLink {
  Eigen::Index from = 0;
  Eigen::Index to = 0;
  Eigen::Matrix3d R_from_to;
  Eigen::Vector3d t_from_to;
  double attitude_weight = 0.0;  ///< mean information of a rotation by a radian
  double position_weight = 0.0;
};

[[nodiscard]] std::vector<PoseGraphLink> links_of(const PoseGraph& graph);

[[nodiscard]] Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix);

}  // namespace ignis
