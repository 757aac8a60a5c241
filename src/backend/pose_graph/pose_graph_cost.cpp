// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/pose_graph_cost.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <unordered_map>

namespace ignis {
namespace {

constexpr double kFreeDirection = 1e-12;  // of the best known one

struct EdgeWeights {
  double kappa = 0.0;
  double tau = 0.0;
};

template <class Block>
bool leaves_direction_free(const Block& information) {
  const Eigen::SelfAdjointEigenSolver<Block> eigen(information, Eigen::EigenvaluesOnly);
  const auto& eigenvalues = eigen.eigenvalues();  // ascending
  return eigenvalues(0) <= kFreeDirection * eigenvalues(eigenvalues.size() - 1);
}

std::optional<EdgeWeights> weights(const Matrix6d& information, bool planar) {
  if (planar) {
    const Eigen::Matrix2d translation = information.block<2, 2>(3, 3);
    if (leaves_direction_free(translation)) return std::nullopt;
    return EdgeWeights{information(2, 2), 2.0 / translation.inverse().trace()};
  }
  const Eigen::Matrix3d attitude = information.topLeftCorner<3, 3>();
  const Eigen::Matrix3d translation = information.bottomRightCorner<3, 3>();
  if (leaves_direction_free(attitude) || leaves_direction_free(translation)) return std::nullopt;
  return EdgeWeights{3.0 / (2.0 * attitude.inverse().trace()), 3.0 / translation.inverse().trace()};
}

}  // namespace

std::optional<double> se_sync_cost(const PoseGraph& graph, const std::vector<KeyframePose>& poses) {
  std::unordered_map<std::int32_t, const Pose*> pose_of;
  for (const KeyframePose& pose : poses) pose_of[pose.id] = &pose.T_map_body;
  double sum = 0.0;
  for (const PoseGraphEdge& edge : graph.edges) {
    const Pose& from = *pose_of.at(edge.from);
    const Pose& to = *pose_of.at(edge.to);
    const std::optional<EdgeWeights> weight = weights(edge.information, graph.planar);
    if (!weight) return std::nullopt;
    const Eigen::Matrix3d R_map_from = from.rotation.toRotationMatrix();
    const Eigen::Matrix3d dR = to.rotation.toRotationMatrix() - R_map_from * edge.T_from_to.rotation.toRotationMatrix();
    const Eigen::Vector3d dt = to.translation - from.translation - R_map_from * edge.T_from_to.translation;
    sum += weight->kappa * dR.squaredNorm() + weight->tau * dt.squaredNorm();
  }
  return sum;
}

}  // namespace ignis
