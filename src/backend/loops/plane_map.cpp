// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/plane_map.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/unordered/unordered_flat_set.hpp>

#include "common/grid.h"

namespace ignis {
namespace {

// A plane must extend in two directions: the middle eigenvalue of a scan line alone is noise.
constexpr double kSmallestWidthRatio = 0.02;

}  // namespace

void PlaneMap::Moments::operator+=(const Moments& other) {
  count += other.count;
  sum += other.sum;
  squares += other.squares;
}

std::vector<CloudPoint> one_per_voxel(std::span<const CloudPoint> cloud, double voxel_m) {
  boost::unordered_flat_set<std::uint64_t> taken;
  std::vector<CloudPoint> kept;
  for (const CloudPoint& point : cloud) {
    if (!point.position.allFinite()) continue;
    const Eigen::Vector3d position = point.position.cast<double>();
    if (taken.insert(key_of(cell_of<double>(position / voxel_m))).second) kept.push_back(point);
  }
  return kept;
}

PlaneMap::PlaneMap(double voxel_m, int fit_reach, const PlaneGates& gates)
    : voxel_m_(voxel_m), fit_reach_(fit_reach), gates_(gates) {}

PlaneMap::PlaneMap(std::span<const CloudInMap> clouds, double voxel_m, const PlaneGates& gates)
    : PlaneMap(voxel_m, 1, gates) {
  for (const CloudInMap& cloud : clouds) {
    const Eigen::Matrix3d R = cloud.T_map_cloud.rotation.toRotationMatrix();
    for (const CloudPoint& point : cloud.points) {
      if (!point.position.allFinite()) continue;
      const Eigen::Vector3d p_map = R * point.position.cast<double>() + cloud.T_map_cloud.translation;
      moments_at(p_map) += {1.0, p_map, p_map * p_map.transpose()};
    }
  }
  note_centres();
}

PlaneMap PlaneMap::coarser(double voxel_m) const {
  PlaneMap coarse(voxel_m, 0, gates_);
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    coarse.moments_at(voxels_[i].centre_of_gravity) += contents_[i].moments;
  }
  coarse.note_centres();
  return coarse;
}

PlaneMap::Moments& PlaneMap::moments_at(const Eigen::Vector3d& point) {
  const Eigen::Vector3i cell = cell_of<double>(point / voxel_m_);
  const std::uint32_t voxel = index_.enter(cell);
  if (voxel == contents_.size()) contents_.push_back({{}, point, cell});
  return contents_[voxel].moments;
}

void PlaneMap::note_centres() {
  voxels_.resize(contents_.size());
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    voxels_[i].centre_of_gravity = contents_[i].moments.sum / contents_[i].moments.count;
  }
}

std::optional<std::size_t> PlaneMap::nearest_voxel(const Eigen::Vector3d& point, double radius_m) const {
  const auto distance2 = [&](std::size_t i) { return (voxels_[i].centre_of_gravity - point).squaredNorm(); };
  const Eigen::Vector3i home = cell_of<double>(point / voxel_m_);
  double best = radius_m * radius_m;
  if (const auto here = index_.find(home)) return distance2(*here) < best ? here : std::nullopt;
  std::optional<std::size_t> nearest;
  index_.for_each_around(home, 1, [&](std::uint32_t there) {
    if (distance2(there) >= best) return;
    best = distance2(there);
    nearest = there;
  });
  return nearest;
}

void PlaneMap::fit(std::size_t voxel) {
  const auto moments_within = [&](int reach) {
    Moments sum;
    index_.for_each_around(contents_[voxel].cell, reach, [&](std::uint32_t there) { sum += contents_[there].moments; });
    return sum;
  };
  voxels_[voxel].fit = Fit::kNoPlane;
  Moments all = moments_within(fit_reach_);
  // In a thin cloud, or far away, the points of a plane lie farther apart.
  if (all.count < gates_.min_points) all = moments_within(2 * fit_reach_);
  if (all.count < gates_.min_points) return;
  const Eigen::Vector3d mean = all.sum / all.count;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(all.squares / all.count - mean * mean.transpose());
  const Eigen::Vector3d& spread = eigen.eigenvalues();
  const bool thin = spread(0) <= gates_.thickness_m * gates_.thickness_m;
  const bool wide = spread(1) >= kSmallestWidthRatio * spread(2) && spread(1) > 4.0 * spread(0);
  if (!thin || !wide) return;
  voxels_[voxel].fit = Fit::kPlane;
  voxels_[voxel].plane = {eigen.eigenvectors().col(0), mean, std::max(0.0, spread(0))};
}

std::optional<SurfacePlane> PlaneMap::plane(std::size_t voxel) {
  const Voxel& asked = voxels_[voxel];
  if (asked.fit == Fit::kUnknown) fit(voxel);
  if (asked.fit == Fit::kNoPlane) return std::nullopt;
  return asked.plane;
}

std::optional<SurfacePlane> PlaneMap::nearest_plane(const Eigen::Vector3d& point, double radius_m) {
  const std::optional<std::size_t> nearest = nearest_voxel(point, radius_m);
  return nearest ? plane(*nearest) : std::nullopt;
}

}  // namespace ignis
