// SPDX-License-Identifier: Apache-2.0
#include "frontend/local_map.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "common/grid.h"

namespace ignis {
namespace {

constexpr std::int32_t kFree = -1;
constexpr std::size_t kFirstCapacity = 1024;
constexpr int kEdgeBits = 2;

/// masks[axis][lo][hi]: the voxels of a block whose coordinate along `axis` is in lo..hi.
using AxisMasks = std::array<std::array<std::array<std::uint64_t, 4>, 4>, 3>;

constexpr AxisMasks make_axis_masks() {
  AxisMasks masks{};
  for (int bit = 0; bit < 64; ++bit) {
    const std::array<int, 3> at = {bit & 3, (bit >> 2) & 3, bit >> 4};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (int lo = 0; lo < 4; ++lo) {
        for (int hi = lo; hi < 4; ++hi) {
          if (at[axis] >= lo && at[axis] <= hi) {
            masks[axis][static_cast<std::size_t>(lo)][static_cast<std::size_t>(hi)] |= std::uint64_t{1} << bit;
          }
        }
      }
    }
  }
  return masks;
}

constexpr AxisMasks kAxisMasks = make_axis_masks();

Eigen::Vector3i voxel_of(const Eigen::Vector3d& point, double voxel_size) {
  return cell_of<double>(point / voxel_size);
}

/// The mask along one axis of the voxels lo..hi (global indices) inside the block `block`.
std::uint64_t axis_mask(std::size_t axis, int block, int lo, int hi) {
  const int first = std::max(lo - (block << kEdgeBits), 0);
  const int last = std::min(hi - (block << kEdgeBits), 3);
  return kAxisMasks[axis][static_cast<std::size_t>(first)][static_cast<std::size_t>(last)];
}

}  // namespace

LocalMap::LocalMap(const FrontendConfig& config)
    : voxel_size_(config.voxel_size_m),
      match_radius_(config.match_radius_m),
      window_(config.map_window_m),
      window_y_(config.map_window_y),
      average_points_(config.map_average_points) {
  config::require_valid(config, "frontend");
  clear();
}

void LocalMap::clear() {
  blocks_.clear();
  table_.assign(kFirstCapacity, kFree);
  size_ = 0;
  scans_ = 0;
  inserted_points_ = 0;
  has_slid_ = false;
}

std::size_t LocalMap::slot_of(const Eigen::Vector3i& coordinate) const {
  // Three large primes spread neighbouring blocks; the high bits of the product are the well-mixed ones.
  const auto x = static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate.x()));
  const auto y = static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate.y()));
  const auto z = static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate.z()));
  const std::uint64_t hash = (x * 0x9E3779B97F4A7C15ULL) ^ (y * 0xC2B2AE3D27D4EB4FULL) ^ (z * 0x165667B19E3779F9ULL);
  return static_cast<std::size_t>((hash ^ (hash >> 29)) * 0xBF58476D1CE4E5B9ULL >> 20) & (table_.size() - 1);
}

const LocalMap::Block* LocalMap::find(const Eigen::Vector3i& coordinate) const {
  for (std::size_t slot = slot_of(coordinate);; slot = (slot + 1) & (table_.size() - 1)) {
    const std::int32_t index = table_[slot];
    if (index == kFree) return nullptr;
    const Block& block = blocks_[static_cast<std::size_t>(index)];
    if (block.coordinate == coordinate) return &block;
  }
}

LocalMap::Block& LocalMap::find_or_add(const Eigen::Vector3i& coordinate) {
  std::size_t slot = slot_of(coordinate);
  for (; table_[slot] != kFree; slot = (slot + 1) & (table_.size() - 1)) {
    Block& block = blocks_[static_cast<std::size_t>(table_[slot])];
    if (block.coordinate == coordinate) return block;
  }
  table_[slot] = static_cast<std::int32_t>(blocks_.size());
  blocks_.emplace_back().coordinate = coordinate;
  if (2 * blocks_.size() > table_.size()) rebuild_table(2 * table_.size());
  return blocks_.back();
}

void LocalMap::rebuild_table(std::size_t capacity) {
  table_.assign(capacity, kFree);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    std::size_t slot = slot_of(blocks_[i].coordinate);
    while (table_[slot] != kFree) slot = (slot + 1) & (table_.size() - 1);
    table_[slot] = static_cast<std::int32_t>(i);
  }
}

void LocalMap::insert(std::span<const Eigen::Vector3f> points_body, const Pose& T_odom_body, bool confirmed) {
  ++scans_;
  inserted_points_ += std::ssize(points_body);
  const Eigen::Matrix3d R = T_odom_body.rotation.toRotationMatrix();
  for (const Eigen::Vector3f& point : points_body) {
    insert_point(R * point.cast<double>() + T_odom_body.translation, confirmed);
  }
}

void LocalMap::insert_point(const Eigen::Vector3d& point, bool confirmed) {
  const Eigen::Vector3i voxel = voxel_of(point, voxel_size_);
  const Eigen::Vector3i coordinate(voxel.x() >> kEdgeBits, voxel.y() >> kEdgeBits, voxel.z() >> kEdgeBits);
  const Eigen::Vector3i inside = voxel - kEdge * coordinate;
  const int bit = inside.x() + kEdge * (inside.y() + kEdge * inside.z());
  const std::uint64_t flag = std::uint64_t{1} << bit;

  Block& block = find_or_add(coordinate);
  const Eigen::Vector3f local = (point - kEdge * voxel_size_ * coordinate.cast<double>()).cast<float>();
  Eigen::Map<Eigen::Vector3f> stored(block.local[bit]);
  float& scan = block.scan[bit];
  std::uint16_t& weight = block.weight[bit];
  const bool taken = (block.occupied & flag) != 0;
  const bool taken_confirmed = (block.confirmed & flag) != 0;
  if (taken_confirmed && !confirmed) return;
  const bool merges = taken && taken_confirmed == confirmed;
  if (merges && average_points_ > 1) {
    if (weight < average_points_) ++weight;
    const float share = 1.0F / static_cast<float>(weight);
    stored += share * (local - stored);
    scan += share * (static_cast<float>(scans_) - scan);
    return;
  }
  if (merges && !nearer_to_centre(local, stored, inside)) return;
  if (!taken) ++size_;
  stored = local;
  scan = static_cast<float>(scans_);
  weight = 1;
  block.occupied |= flag;
  if (confirmed) block.confirmed |= flag;
}

bool LocalMap::nearer_to_centre(const Eigen::Vector3f& point, const Eigen::Vector3f& stored,
                                const Eigen::Vector3i& inside) const {
  const Eigen::Vector3f centre = ((inside.cast<double>().array() + 0.5) * voxel_size_).matrix().cast<float>();
  return (point - centre).squaredNorm() < (stored - centre).squaredNorm();
}

void LocalMap::for_each_near(const Eigen::Vector3d& query, double radius, auto&& visit) const {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(radius);
  const Eigen::Vector3i lo = voxel_of(query - reach, voxel_size_);
  const Eigen::Vector3i hi = voxel_of(query + reach, voxel_size_);
  const auto radius2 = static_cast<float>(radius * radius);
  const double block_size = kEdge * voxel_size_;
  for (int z = lo.z() >> kEdgeBits; z <= hi.z() >> kEdgeBits; ++z) {
    const std::uint64_t mask_z = axis_mask(2, z, lo.z(), hi.z());
    for (int y = lo.y() >> kEdgeBits; y <= hi.y() >> kEdgeBits; ++y) {
      const std::uint64_t mask_yz = mask_z & axis_mask(1, y, lo.y(), hi.y());
      for (int x = lo.x() >> kEdgeBits; x <= hi.x() >> kEdgeBits; ++x) {
        const Block* block = find({x, y, z});
        if (block == nullptr) continue;
        const Eigen::Vector3f origin = (query - block_size * block->coordinate.cast<double>()).cast<float>();
        for (std::uint64_t left = block->confirmed & mask_yz & axis_mask(0, x, lo.x(), hi.x()); left != 0;
             left &= left - 1) {
          const int bit = std::countr_zero(left);
          const Eigen::Vector3f offset = Eigen::Map<const Eigen::Vector3f>(block->local[bit]) - origin;
          if (offset.squaredNorm() <= radius2) visit(offset, *block, bit);
        }
      }
    }
  }
}

NeighbourMoments LocalMap::gather(const Eigen::Vector3d& query, double radius) const {
  NeighbourMoments moments;
  for_each_near(query, radius, [&](const Eigen::Vector3f& offset, const Block& block, int bit) {
    moments.add(offset.cast<double>(), block.scan[bit]);
  });
  return moments;
}

std::optional<Eigen::Vector3d> LocalMap::nearest(const Eigen::Vector3d& query, double radius) const {
  std::optional<Eigen::Vector3f> best;
  for_each_near(query, radius, [&](const Eigen::Vector3f& offset, const Block&, int) {
    if (!best || offset.squaredNorm() < best->squaredNorm()) best = offset;
  });
  if (!best) return std::nullopt;
  return query + best->cast<double>();
}

void LocalMap::slide(const Eigen::Vector3d& position) {
  if (has_slid_ && (position - last_slide_).norm() < 0.25 * window_) return;
  if (!has_slid_) {
    has_slid_ = true;
    last_slide_ = position;
    return;
  }
  last_slide_ = position;
  const Eigen::Vector3d window(window_, window_y_, window_);
  for (Block& block : blocks_) {
    const Eigen::Vector3d corner = kEdge * voxel_size_ * block.coordinate.cast<double>();
    for (std::uint64_t left = block.occupied; left != 0; left &= left - 1) {
      const int bit = std::countr_zero(left);
      const Eigen::Vector3d point = corner + Eigen::Map<const Eigen::Vector3f>(block.local[bit]).cast<double>();
      if (((point - position).cwiseAbs().array() <= window.array()).all()) continue;
      block.occupied &= ~(std::uint64_t{1} << bit);
      block.confirmed &= ~(std::uint64_t{1} << bit);
      --size_;
    }
  }
  std::erase_if(blocks_, [](const Block& block) { return block.occupied == 0; });
  fit_table();
}

void LocalMap::fit_table() { rebuild_table(std::max(kFirstCapacity, std::bit_ceil(2 * blocks_.size() + 1))); }

std::vector<Eigen::Vector3d> LocalMap::points() const {
  std::vector<Eigen::Vector3d> all;
  all.reserve(static_cast<std::size_t>(size_));
  for (const Block& block : blocks_) {
    const Eigen::Vector3d corner = kEdge * voxel_size_ * block.coordinate.cast<double>();
    for (std::uint64_t left = block.occupied; left != 0; left &= left - 1) {
      all.push_back(corner + Eigen::Map<const Eigen::Vector3f>(block.local[std::countr_zero(left)]).cast<double>());
    }
  }
  return all;
}

}  // namespace ignis
