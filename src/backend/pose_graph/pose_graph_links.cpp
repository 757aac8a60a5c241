// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/pose_graph_links.h"

#include <Eigen/SVD>
#include <unordered_map>

namespace ignis {

std::vector<PoseGraphLink> links_of(const PoseGraph& graph) {
  std::unordered_map<std::int32_t, Eigen::Index> place;
  for (const KeyframePose& vertex : graph.vertices) place.emplace(vertex.id, std::ssize(place));
  std::vector<PoseGraphLink> links;
  links.reserve(graph.edges.size());
  for (const PoseGraphEdge& edge : graph.edges) {
    // In the plane nothing is said of the other directions, but they hold by themselves.
    const double attitude =
        graph.planar ? edge.information(2, 2) : edge.information.topLeftCorner<3, 3>().trace() / 3.0;
    const double position = graph.planar ? edge.information.block<2, 2>(3, 3).trace() / 2.0
                                         : edge.information.bottomRightCorner<3, 3>().trace() / 3.0;
    links.push_back({place.at(edge.from), place.at(edge.to), edge.T_from_to.rotation.toRotationMatrix(),
                     edge.T_from_to.translation, attitude, position});
  }
  return links;
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d product = svd.matrixU() * svd.matrixV().transpose();
  const Eigen::Vector3d signs(1.0, 1.0, product.determinant() < 0.0 ? -1.0 : 1.0);
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace ignis
