// SPDX-License-Identifier: Apache-2.0
#include "backend/plane_map.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/unordered/unordered_flat_set.hpp>
#include <cmath>
#include <numeric>

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

/// Squared distance of a coordinate from the slab of a cell [m^2].
double slab_distance2(double coordinate, int cell) {
  const double low = cell * kCellSize;
  const double d = std::max({low - coordinate, coordinate - (low + kCellSize), 0.0});
  return d * d;
}

/// From a point to the nearest face of its own cell [m].
double distance_to_faces(const Eigen::Vector3d& point, const Eigen::Vector3i& home) {
  const Eigen::Vector3d inside = point - kCellSize * home.cast<double>();
  return std::max(0.0, std::min(inside.minCoeff(), kCellSize - inside.maxCoeff()));
}

}  // namespace

std::vector<Eigen::Vector3d> one_per_voxel(std::span<const Eigen::Vector3d> points, double voxel_m) {
  boost::unordered_flat_set<std::uint64_t> taken;
  taken.reserve(points.size());
  std::vector<Eigen::Vector3d> kept;
  for (const Eigen::Vector3d& point : points) {
    if (taken.insert(key_of(cell_at(point, voxel_m))).second) kept.push_back(point);
  }
  return kept;
}

PlaneMap::PlaneMap(std::span<const Eigen::Vector3d> points, double voxel_m, const PlaneGates& gates) : gates_(gates) {
  sort_into_cells(one_per_voxel(points, voxel_m));
  entries_.resize(points_.size());
}

void PlaneMap::sort_into_cells(std::span<const Eigen::Vector3d> points) {
  std::vector<std::uint64_t> keys(points.size());
  std::ranges::transform(points, keys.begin(), [](const auto& point) { return key_of(cell_at(point, kCellSize)); });
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return keys[i]; });
  points_.reserve(points.size());
  for (const std::size_t i : order) {
    Range& range = cells_.try_emplace(keys[i], Range{points_.size(), points_.size()}).first->second;
    points_.push_back(points[i]);
    range.end = points_.size();
  }
}

PlaneMap::Range PlaneMap::points_of(const Eigen::Vector3i& cell) const {
  const auto found = cells_.find(key_of(cell));
  return found == cells_.end() ? Range{} : found->second;
}

std::optional<std::size_t> PlaneMap::nearest_point(const Eigen::Vector3d& point, double radius_m) const {
  const Eigen::Vector3i home = cell_at(point, kCellSize);
  const double to_faces = distance_to_faces(point, home);
  double best = radius_m * radius_m;
  std::optional<std::size_t> nearest;
  for (int shell = 0;; ++shell) {
    const double closest = shell == 0 ? 0.0 : (shell - 1) * kCellSize + to_faces;
    if (closest * closest >= best) break;
    for (int x = -shell; x <= shell; ++x) {
      const double in_x = slab_distance2(point.x(), home.x() + x);
      if (in_x >= best) continue;
      for (int y = -shell; y <= shell; ++y) {
        const double in_xy = in_x + slab_distance2(point.y(), home.y() + y);
        if (in_xy >= best) continue;
        const bool on_face = std::abs(x) == shell || std::abs(y) == shell;
        for (int z = -shell; z <= shell; z += (on_face || shell == 0) ? 1 : 2 * shell) {
          if (in_xy + slab_distance2(point.z(), home.z() + z) >= best) continue;
          const Range range = points_of(home + Eigen::Vector3i(x, y, z));
          for (std::size_t i = range.begin; i < range.end; ++i) {
            const double distance = (points_[i] - point).squaredNorm();
            if (distance >= best) continue;
            best = distance;
            nearest = i;
          }
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
        const Range range = points_of({x, y, z});
        for (std::size_t i = range.begin; i < range.end; ++i) {
          const Eigen::Vector3d d = points_[i] - at;  // centred on the query: no cancellation far from the origin
          if (d.squaredNorm() > gates_.radius_m * gates_.radius_m) continue;
          ++count;
          sum += d;
          squares += d * d.transpose();
        }
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
