// SPDX-License-Identifier: Apache-2.0
#include "map/voxel_level.h"

#include <algorithm>

#include "common/grid.h"

namespace ignis {
namespace {

constexpr int kBits = 21;
constexpr std::int32_t kBias = 1 << (kBits - 1);
constexpr std::uint64_t kMask = (1ULL << kBits) - 1;

}  // namespace

VoxelLevel::Key VoxelLevel::pack(const CellIndex& cell) {
  const auto axis = [](std::int32_t index) { return static_cast<Key>(index + kBias) & kMask; };
  return axis(cell.x) << (2 * kBits) | axis(cell.y) << kBits | axis(cell.z);
}

CellIndex VoxelLevel::unpack(Key key) {
  const auto axis = [](Key bits) { return static_cast<std::int32_t>(bits & kMask) - kBias; };
  return {axis(key >> (2 * kBits)), axis(key >> kBits), axis(key)};
}

CellIndex VoxelLevel::cell_of(const Eigen::Vector3d& p_world) const {
  const auto axis = [this](double coordinate) { return floor_to_int(coordinate / cell_m_); };
  return {axis(p_world.x()), axis(p_world.y()), axis(p_world.z())};
}

Eigen::Vector3d VoxelLevel::centre_of(const CellIndex& cell) const {
  return cell_m_ * (Eigen::Vector3d(cell.x, cell.y, cell.z) + Eigen::Vector3d::Constant(0.5));
}

MapPoint VoxelLevel::to_point(const CellIndex& cell, const Voxel& voxel) const {
  return {centre_of(cell) + voxel.from_centre.cast<double>(), voxel.intensity, voxel.keyframe_id};
}

void VoxelLevel::insert(const MapPoint& point) {
  const CellIndex cell = cell_of(point.p_world);
  const Voxel candidate{(point.p_world - centre_of(cell)).cast<float>(), point.intensity, point.keyframe_id};
  const auto [found, is_new] = voxels_.try_emplace(pack(cell), candidate);
  if (!is_new && candidate.from_centre.squaredNorm() < found->second.from_centre.squaredNorm()) {
    found->second = candidate;
  }
}

void VoxelLevel::extract(const std::function<bool(const Eigen::Vector3d&)>& leaves,
                         const std::function<void(const MapPoint&)>& receive) {
  boost::unordered::erase_if(voxels_, [&](const auto& entry) {
    const MapPoint point = to_point(unpack(entry.first), entry.second);
    if (!leaves(point.p_world)) return false;
    receive(point);
    return true;
  });
}

bool VoxelLevel::contains(const CellIndex& cell) const { return voxels_.contains(pack(cell)); }

std::optional<MapPoint> VoxelLevel::find(const CellIndex& cell) const {
  const auto found = voxels_.find(pack(cell));
  if (found == voxels_.end()) return std::nullopt;
  return to_point(cell, found->second);
}

std::vector<std::pair<CellIndex, MapPoint>> VoxelLevel::sorted() const {
  std::vector<std::pair<CellIndex, MapPoint>> voxels;
  voxels.reserve(size());
  for_each([&](const CellIndex& cell, const MapPoint& point) { voxels.emplace_back(cell, point); });
  std::ranges::sort(voxels, {}, [](const auto& entry) { return entry.first; });
  return voxels;
}

std::size_t VoxelLevel::bytes() const { return voxels_.bucket_count() * (sizeof(decltype(voxels_)::value_type) + 1); }

}  // namespace ignis
