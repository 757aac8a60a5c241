// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/chordal_start.h"

#include <Eigen/SparseCholesky>
#include <optional>

#include "backend/pose_graph/pose_graph_links.h"

namespace ignis {
namespace {

using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// Least squares over sum weight ||x_to - A x_from - b||^2 in blocks of `kBlock` rows, the first one known; A
/// orthogonal.
template <int kBlock>
class LinkedSystem {
 public:
  using Block = Eigen::Matrix<double, kBlock, kBlock>;
  using Right = Eigen::Matrix<double, kBlock, 3>;

  LinkedSystem(Eigen::Index blocks, const Right& first)
      : first_(first), right_(Rows3::Zero((blocks - 1) * kBlock, 3)) {}

  void add(const PoseGraphLink& link, double weight, const Block& A, const Right& b) {
    add_half(link.to, link.from, weight, A, b);
    add_half(link.from, link.to, weight, A.transpose(), -(A.transpose() * b));
  }

  /// All blocks, one below the other.
  [[nodiscard]] std::optional<Rows3> solve() const {
    Eigen::SparseMatrix<double> matrix(right_.rows(), right_.rows());
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> factorised(matrix);
    if (factorised.info() != Eigen::Success) return std::nullopt;
    Rows3 all(right_.rows() + kBlock, 3);
    all << first_, factorised.solve(right_);
    if (!all.allFinite()) return std::nullopt;
    return all;
  }

 private:
  /// Rows of the normal equations that belong to `at`, which wants to be A * other + b.
  void add_half(Eigen::Index at, Eigen::Index other, double weight, const Block& A, const Right& b) {
    if (at == 0) return;
    const Eigen::Index row = (at - 1) * kBlock;
    const Eigen::Index column = (other - 1) * kBlock;
    for (int i = 0; i < kBlock; ++i) {
      entries_.emplace_back(row + i, row + i, weight);
      for (int k = 0; k < kBlock && other > 0; ++k) entries_.emplace_back(row + i, column + k, -weight * A(i, k));
    }
    right_.template middleRows<kBlock>(row) += weight * b;
    if (other == 0) right_.template middleRows<kBlock>(row) += weight * A * first_;
  }

  Right first_;
  Rows3 right_;
  std::vector<Eigen::Triplet<double>> entries_;
};

}  // namespace

std::vector<KeyframePose> with_positions(const PoseGraph& graph, const std::vector<Eigen::Matrix3d>& attitudes) {
  std::vector<KeyframePose> poses = graph.vertices;
  if (poses.empty() || attitudes.size() != poses.size()) return {};
  const Eigen::Matrix3d R_map_common = poses.front().T_map_body.rotation * attitudes.front().transpose();
  LinkedSystem<1> positions(std::ssize(poses), poses.front().T_map_body.translation.transpose());
  for (const PoseGraphLink& link : links_of(graph)) {
    const Eigen::Vector3d step = R_map_common * attitudes[static_cast<std::size_t>(link.from)] * link.t_from_to;
    positions.add(link, link.position_weight, Eigen::Matrix<double, 1, 1>::Identity(), step.transpose());
  }
  const std::optional<Rows3> placed = positions.solve();
  if (!placed) return {};
  for (std::size_t i = 1; i < poses.size(); ++i) {
    poses[i].T_map_body.rotation = Eigen::Quaterniond(R_map_common * attitudes[i]).normalized();
    poses[i].T_map_body.translation = placed->row(static_cast<Eigen::Index>(i)).transpose();
  }
  return poses;
}

std::vector<KeyframePose> chordal_start(const PoseGraph& graph) {
  const std::vector<KeyframePose>& poses = graph.vertices;
  if (poses.size() < 2) return poses;
  // Unknown are the transposed attitudes: R_to' = R_from_to' R_from'.
  LinkedSystem<3> attitudes(std::ssize(poses), poses.front().T_map_body.rotation.toRotationMatrix().transpose());
  for (const PoseGraphLink& link : links_of(graph)) {
    attitudes.add(link, link.attitude_weight, link.R_from_to.transpose(), Eigen::Matrix3d::Zero());
  }
  const std::optional<Rows3> transposed = attitudes.solve();
  if (!transposed) return {};
  std::vector<Eigen::Matrix3d> R_map_body;
  for (Eigen::Index i = 0; i < std::ssize(poses); ++i) {
    R_map_body.push_back(nearest_rotation(transposed->middleRows<3>(3 * i).transpose()));
  }
  return with_positions(graph, R_map_body);
}

}  // namespace ignis
