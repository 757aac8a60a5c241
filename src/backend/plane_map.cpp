// SPDX-License-Identifier: Apache-2.0
#include "backend/plane_map.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "common/grid.h"

namespace ignis {
namespace {

constexpr double kCellSize = 0.5;  // [m] a search for neighbours looks at a few cells of this size
// A plane must extend in two directions: the middle eigenvalue of a scan line alone is noise.
constexpr double kSmallestWidthRatio = 0.02;

Eigen::Vector3i cell_at(const Eigen::Vector3d& point, double size) { return cell_of<double>(point / size); }

std::uint64_t key_of(const Eigen::Vector3i& cell) {
  constexpr std::uint64_t kMask = (1U << 21U) - 1U;
  const auto part = [](int v) { return static_cast<std::uint64_t>(static_cast<std::int64_t>(v)) & kMask; };
  return (part(cell.x()) << 42U) | (part(cell.y()) << 21U) | part(cell.z());
}

}  // namespace

std::vector<Eigen::Vector3d> one_per_voxel(std::span<const Eigen::Vector3d> points, double voxel_m) {
  std::unordered_set<std::uint64_t> taken;
  std::vector<Eigen::Vector3d> kept;
  for (const Eigen::Vector3d& point : points) {
    if (taken.insert(key_of(cell_at(point, voxel_m))).second) kept.push_back(point);
  }
  return kept;
}

PlaneMap::PlaneMap(std::span<const Eigen::Vector3d> points, double voxel_m, const PlaneGates& gates)
    : gates_(gates), points_(one_per_voxel(points, voxel_m)), entries_(points_.size()) {
  for (std::size_t i = 0; i < points_.size(); ++i) cells_[key_of(cell_at(points_[i], kCellSize))].push_back(i);
}

template <class Visit>
void PlaneMap::visit_cell(const Eigen::Vector3i& cell, Visit visit) const {
  const auto found = cells_.find(key_of(cell));
  if (found == cells_.end()) return;
  for (const std::size_t i : found->second) visit(i);
}

std::optional<std::size_t> PlaneMap::nearest_point(const Eigen::Vector3d& point, double radius_m) const {
  const Eigen::Vector3i home = cell_at(point, kCellSize);
  const int reach = static_cast<int>(std::ceil(radius_m / kCellSize));
  double best = radius_m * radius_m;
  std::optional<std::size_t> nearest;
  for (int shell = 0; shell <= reach; ++shell) {
    // Everything in this shell is at least (shell - 1) whole cells away.
    const double closest = std::max(0, shell - 1) * kCellSize;
    if (nearest && closest * closest > best) break;
    for (int x = -shell; x <= shell; ++x) {
      for (int y = -shell; y <= shell; ++y) {
        const bool on_face = std::abs(x) == shell || std::abs(y) == shell;
        for (int z = -shell; z <= shell; z += (on_face || shell == 0) ? 1 : 2 * shell) {
          visit_cell(home + Eigen::Vector3i(x, y, z), [&](std::size_t i) {
            const double distance = (points_[i] - point).squaredNorm();
            if (distance < best) {
              best = distance;
              nearest = i;
            }
          });
        }
      }
    }
  }
  return nearest;
}

PlaneMap::Entry PlaneMap::fit_plane(const Eigen::Vector3d& at) const {
  const Eigen::Vector3i low = cell_at(at - Eigen::Vector3d::Constant(gates_.radius_m), kCellSize);
  const Eigen::Vector3i high = cell_at(at + Eigen::Vector3d::Constant(gates_.radius_m), kCellSize);
  int count = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int z = low.z(); z <= high.z(); ++z) {
        visit_cell({x, y, z}, [&](std::size_t i) {
          const Eigen::Vector3d d = points_[i] - at;  // centred on the query: no cancellation far from the origin
          if (d.squaredNorm() > gates_.radius_m * gates_.radius_m) return;
          ++count;
          sum += d;
          squares += d * d.transpose();
        });
      }
    }
  }
  if (count < gates_.min_points) return {Fit::kNoPlane, {}};
  const Eigen::Vector3d mean = sum / count;
  const Eigen::Matrix3d covariance = squares / count - mean * mean.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance);
  const Eigen::Vector3d& spread = eigen.eigenvalues();
  const bool thin = spread(0) <= gates_.thickness_m * gates_.thickness_m;
  const bool wide = spread(1) >= kSmallestWidthRatio * spread(2) && spread(1) > 4.0 * spread(0);
  if (!thin || !wide) return {Fit::kNoPlane, {}};
  return {Fit::kPlane, {eigen.eigenvectors().col(0), at + mean}};
}

std::optional<SurfacePlane> PlaneMap::nearest_plane(const Eigen::Vector3d& point, double radius_m) {
  const std::optional<std::size_t> nearest = nearest_point(point, radius_m);
  if (!nearest) return std::nullopt;
  Entry& entry = entries_[*nearest];
  if (entry.fit == Fit::kUnknown) entry = fit_plane(points_[*nearest]);
  if (entry.fit == Fit::kNoPlane) return std::nullopt;
  return entry.plane;
}

}  // namespace ignis
