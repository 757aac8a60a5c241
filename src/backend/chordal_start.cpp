// SPDX-License-Identifier: Apache-2.0
#include "backend/chordal_start.h"

#include <Eigen/SVD>
#include <Eigen/SparseCholesky>
#include <optional>
#include <unordered_map>

namespace ignis {
namespace {

using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// An edge between places in the graph's vertices, weighed alike in all directions: this is but a start.
struct Link {
  Eigen::Index from = 0;
  Eigen::Index to = 0;
  Eigen::Matrix3d R_from_to;
  Eigen::Vector3d t_from_to;
  double attitude_weight = 0.0;
  double position_weight = 0.0;
};

std::vector<Link> links_of(const PoseGraph& graph) {
  std::unordered_map<std::int32_t, Eigen::Index> place;
  for (const KeyframePose& vertex : graph.vertices) place.emplace(vertex.id, std::ssize(place));
  std::vector<Link> links;
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

/// Least squares over sum weight ||x_to - A x_from - b||^2 in blocks of `kBlock` rows, the first one known; A
/// orthogonal.
template <int kBlock>
class LinkedSystem {
 public:
  using Block = Eigen::Matrix<double, kBlock, kBlock>;
  using Right = Eigen::Matrix<double, kBlock, 3>;

  LinkedSystem(Eigen::Index blocks, const Right& first)
      : first_(first), right_(Rows3::Zero((blocks - 1) * kBlock, 3)) {}

  void add(const Link& link, double weight, const Block& A, const Right& b) {
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

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d product = svd.matrixU() * svd.matrixV().transpose();
  const Eigen::Vector3d signs(1.0, 1.0, product.determinant() < 0.0 ? -1.0 : 1.0);
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

std::vector<KeyframePose> chordal_start(const PoseGraph& graph) {
  std::vector<KeyframePose> poses = graph.vertices;
  if (poses.size() < 2) return poses;
  const std::vector<Link> links = links_of(graph);
  // Unknown are the transposed attitudes: R_to' = R_from_to' R_from'.
  LinkedSystem<3> attitudes(std::ssize(poses), poses.front().T_map_body.rotation.toRotationMatrix().transpose());
  for (const Link& link : links) {
    attitudes.add(link, link.attitude_weight, link.R_from_to.transpose(), Eigen::Matrix3d::Zero());
  }
  const std::optional<Rows3> transposed = attitudes.solve();
  if (!transposed) return {};
  std::vector<Eigen::Matrix3d> R_map_body;
  for (Eigen::Index i = 0; i < std::ssize(poses); ++i) {
    R_map_body.push_back(nearest_rotation(transposed->middleRows<3>(3 * i).transpose()));
  }
  LinkedSystem<1> positions(std::ssize(poses), poses.front().T_map_body.translation.transpose());
  for (const Link& link : links) {
    const Eigen::Vector3d step = R_map_body[static_cast<std::size_t>(link.from)] * link.t_from_to;
    positions.add(link, link.position_weight, Eigen::Matrix<double, 1, 1>::Identity(), step.transpose());
  }
  const std::optional<Rows3> placed = positions.solve();
  if (!placed) return {};
  for (std::size_t i = 1; i < poses.size(); ++i) {
    poses[i].T_map_body.rotation = Eigen::Quaterniond(R_map_body[i]).normalized();
    poses[i].T_map_body.translation = placed->row(static_cast<Eigen::Index>(i)).transpose();
  }
  return poses;
}

}  // namespace ignis
