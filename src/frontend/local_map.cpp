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
constexpr std::size_t kFirstCapacity = 256;
constexpr int kEdgeBits = 2;

// Four numbers side by side: one register of any 64-bit x86 or ARM.
using Lanes = float __attribute__((vector_size(16)));
using LaneMask = std::int32_t __attribute__((vector_size(16)));

/// kLaneMasks[n]: lane k is chosen when bit k of n is set.
constexpr std::array<std::array<std::int32_t, 4>, 16> make_lane_masks() {
  std::array<std::array<std::int32_t, 4>, 16> masks{};
  for (std::size_t n = 0; n < 16; ++n) {
    for (std::size_t k = 0; k < 4; ++k) masks[n][k] = (n >> k & 1U) != 0 ? -1 : 0;
  }
  return masks;
}

alignas(16) constexpr std::array<std::array<std::int32_t, 4>, 16> kLaneMasks = make_lane_masks();

Lanes all_lanes(float value) { return Lanes{value, value, value, value}; }
Lanes load(const float (&values)[4]) { return std::bit_cast<Lanes>(values); }
double sum(Lanes lanes) { return static_cast<double>((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])); }

/// masks[axis][lo][hi]: the cells of a 4x4x4 cube whose coordinate along `axis` is in lo..hi.
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

/// The mask along one axis of the cells lo..hi (global indices) inside the cube `cube`.
std::uint64_t axis_mask(std::size_t axis, int cube, int lo, int hi) {
  const int first = std::max(lo - (cube << kEdgeBits), 0);
  const int last = std::min(hi - (cube << kEdgeBits), 3);
  return kAxisMasks[axis][static_cast<std::size_t>(first)][static_cast<std::size_t>(last)];
}

/// The mask of the cells in the box lo..hi inside the cube at `cube`, which the box meets.
std::uint64_t box_mask(const Eigen::Vector3i& cube, const Eigen::Vector3i& lo, const Eigen::Vector3i& hi) {
  return axis_mask(0, cube.x(), lo.x(), hi.x()) & axis_mask(1, cube.y(), lo.y(), hi.y()) &
         axis_mask(2, cube.z(), lo.z(), hi.z());
}

/// The cube that a cell lies in.
Eigen::Vector3i cube_of(const Eigen::Vector3i& cell) {
  return {cell.x() >> kEdgeBits, cell.y() >> kEdgeBits, cell.z() >> kEdgeBits};
}

int bit_of(const Eigen::Vector3i& inside) { return inside.x() + 4 * (inside.y() + 4 * inside.z()); }

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

Eigen::Vector3f LocalMap::Block::point(int bit) const {
  const Row& row = rows[bit / kEdge];
  const int lane = bit % kEdge;
  return {row.x[lane], row.y[lane], row.z[lane]};
}

void LocalMap::Block::set_point(int bit, const Eigen::Vector3f& local) {
  Row& row = rows[bit / kEdge];
  const int lane = bit % kEdge;
  row.x[lane] = local.x();
  row.y[lane] = local.y();
  row.z[lane] = local.z();
}

void LocalMap::clear() {
  blocks_.clear();
  regions_.clear();
  table_.assign(kFirstCapacity, kFree);
  size_ = 0;
  scans_ = 0;
  inserted_points_ = 0;
  has_slid_ = false;
}

std::size_t LocalMap::slot_of(const Eigen::Vector3i& coordinate) const {
  // Three large primes spread neighbouring regions; the high bits of the product are the well-mixed ones.
  const auto x = static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate.x()));
  const auto y = static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate.y()));
  const auto z = static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate.z()));
  const std::uint64_t hash = (x * 0x9E3779B97F4A7C15ULL) ^ (y * 0xC2B2AE3D27D4EB4FULL) ^ (z * 0x165667B19E3779F9ULL);
  return static_cast<std::size_t>((hash ^ (hash >> 29)) * 0xBF58476D1CE4E5B9ULL >> 20) & (table_.size() - 1);
}

const LocalMap::Region* LocalMap::find_region(const Eigen::Vector3i& coordinate) const {
  for (std::size_t slot = slot_of(coordinate);; slot = (slot + 1) & (table_.size() - 1)) {
    const std::int32_t index = table_[slot];
    if (index == kFree) return nullptr;
    const Region& region = regions_[static_cast<std::size_t>(index)];
    if (region.coordinate == coordinate) return &region;
  }
}

LocalMap::Region& LocalMap::find_or_add_region(const Eigen::Vector3i& coordinate) {
  std::size_t slot = slot_of(coordinate);
  for (; table_[slot] != kFree; slot = (slot + 1) & (table_.size() - 1)) {
    Region& region = regions_[static_cast<std::size_t>(table_[slot])];
    if (region.coordinate == coordinate) return region;
  }
  table_[slot] = static_cast<std::int32_t>(regions_.size());
  regions_.emplace_back().coordinate = coordinate;
  if (2 * regions_.size() > table_.size()) rebuild_table(2 * table_.size());
  return regions_.back();
}

std::int32_t LocalMap::find_or_add_block(const Eigen::Vector3i& coordinate) {
  const Eigen::Vector3i parent = cube_of(coordinate);
  const int bit = bit_of(coordinate - kEdge * parent);
  Region& region = find_or_add_region(parent);
  if ((region.present >> bit & 1U) == 0) {
    region.present |= std::uint64_t{1} << bit;
    region.blocks[bit] = static_cast<std::int32_t>(blocks_.size());
    blocks_.emplace_back().coordinate = coordinate;
  }
  return region.blocks[bit];
}

void LocalMap::rebuild_table(std::size_t capacity) {
  table_.assign(capacity, kFree);
  for (std::size_t i = 0; i < regions_.size(); ++i) {
    std::size_t slot = slot_of(regions_[i].coordinate);
    while (table_[slot] != kFree) slot = (slot + 1) & (table_.size() - 1);
    table_[slot] = static_cast<std::int32_t>(i);
  }
}

/// The regions of blocks that have changed their places.
void LocalMap::rebuild_regions() {
  regions_.clear();
  table_.assign(kFirstCapacity, kFree);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const Eigen::Vector3i parent = cube_of(blocks_[i].coordinate);
    const int bit = bit_of(blocks_[i].coordinate - kEdge * parent);
    Region& region = find_or_add_region(parent);
    region.present |= std::uint64_t{1} << bit;
    region.blocks[bit] = static_cast<std::int32_t>(i);
  }
}

void LocalMap::insert(std::span<const Eigen::Vector3f> points_body, const Pose& T_odom_body, bool confirmed) {
  insert_all(points_body, T_odom_body, confirmed, [](const Eigen::Vector3f& point) { return point; });
}

void LocalMap::insert(std::span<const CloudPoint> cloud_body, const Pose& T_odom_body, bool confirmed) {
  insert_all(cloud_body, T_odom_body, confirmed, [](const CloudPoint& point) { return point.position; });
}

void LocalMap::insert_all(auto points, const Pose& T_odom_body, bool confirmed, auto position_of) {
  ++scans_;
  inserted_points_ += std::ssize(points);
  const Eigen::Matrix3d R = T_odom_body.rotation.toRotationMatrix();
  // A scan stays in a block for some points before it goes on to the next.
  std::int32_t block = kFree;
  Eigen::Vector3i block_at = Eigen::Vector3i::Zero();
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();
  std::array<Place, 32> places;
  while (!points.empty()) {
    const std::size_t count = std::min(places.size(), points.size());
    // The lines of a batch are asked for before the first of them is needed.
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d point = R * position_of(points[i]).template cast<double>() + T_odom_body.translation;
      const Eigen::Vector3i voxel = voxel_of(point, voxel_size_);
      const Eigen::Vector3i coordinate = cube_of(voxel);
      if (block == kFree || coordinate != block_at) {
        block = find_or_add_block(coordinate);
        block_at = coordinate;
        corner = kEdge * voxel_size_ * coordinate.cast<double>();
      }
      places[i] = {(point - corner).cast<float>(), block, bit_of(voxel - kEdge * coordinate)};
      const Block& there = blocks_[static_cast<std::size_t>(block)];
      __builtin_prefetch(&there.rows[places[i].bit / kEdge]);
      __builtin_prefetch(&there.weight[places[i].bit]);
      __builtin_prefetch(&there.occupied);
    }
    for (const Place& place : std::span(places).first(count)) insert_point(place, confirmed);
    points = points.subspan(count);
  }
}

void LocalMap::insert_point(const Place& place, bool confirmed) {
  Block& block = blocks_[static_cast<std::size_t>(place.block)];
  const int bit = place.bit;
  const std::uint64_t flag = std::uint64_t{1} << bit;
  const Eigen::Vector3f& local = place.local;
  float& scan = block.rows[bit / kEdge].scan[bit % kEdge];
  const bool taken = (block.occupied & flag) != 0;
  const bool taken_confirmed = (block.confirmed & flag) != 0;
  if (taken_confirmed && !confirmed) return;
  const bool merges = taken && taken_confirmed == confirmed;
  if (merges && average_points_ > 1) {
    std::uint16_t& weight = block.weight[bit];
    if (weight < average_points_) ++weight;
    const float share = 1.0F / static_cast<float>(weight);
    const Eigen::Vector3f stored = block.point(bit);
    block.set_point(bit, stored + share * (local - stored));
    scan += share * (static_cast<float>(scans_) - scan);
    return;
  }
  if (merges && !nearer_to_centre(local, block.point(bit), bit)) return;
  if (!taken) ++size_;
  block.set_point(bit, local);
  scan = static_cast<float>(scans_);
  block.weight[bit] = 1;
  block.occupied |= flag;
  if (confirmed) block.confirmed |= flag;
}

bool LocalMap::nearer_to_centre(const Eigen::Vector3f& point, const Eigen::Vector3f& stored, int bit) const {
  const Eigen::Vector3i inside(bit % kEdge, bit / kEdge % kEdge, bit / (kEdge * kEdge));
  const Eigen::Vector3f centre = ((inside.cast<double>().array() + 0.5) * voxel_size_).matrix().cast<float>();
  return (point - centre).squaredNorm() < (stored - centre).squaredNorm();
}

void LocalMap::for_each_row(const Eigen::Vector3d& query, double radius, auto&& visit) const {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(radius);
  const Eigen::Vector3i lo = voxel_of(query - reach, voxel_size_);
  const Eigen::Vector3i hi = voxel_of(query + reach, voxel_size_);
  const Eigen::Vector3i block_lo = cube_of(lo);
  const Eigen::Vector3i block_hi = cube_of(hi);
  const Eigen::Vector3i region_lo = cube_of(block_lo);
  const Eigen::Vector3i region_hi = cube_of(block_hi);
  const double block_size = kEdge * voxel_size_;
  Eigen::Vector3i at;
  for (at.z() = region_lo.z(); at.z() <= region_hi.z(); ++at.z()) {
    for (at.y() = region_lo.y(); at.y() <= region_hi.y(); ++at.y()) {
      for (at.x() = region_lo.x(); at.x() <= region_hi.x(); ++at.x()) {
        const Region* region = find_region(at);
        if (region == nullptr) continue;
        for (std::uint64_t left = region->present & box_mask(at, block_lo, block_hi); left != 0; left &= left - 1) {
          const Block& block = blocks_[static_cast<std::size_t>(region->blocks[std::countr_zero(left)])];
          std::uint64_t voxels = block.confirmed & box_mask(block.coordinate, lo, hi);
          if (voxels == 0) continue;
          const Eigen::Vector3f local = (query - block_size * block.coordinate.cast<double>()).cast<float>();
          while (voxels != 0) {
            const int row = std::countr_zero(voxels) / kEdge;
            const auto lanes = static_cast<std::uint32_t>(voxels >> (kEdge * row) & 0xFU);
            visit(block.rows[row], lanes, local);
            voxels &= ~(std::uint64_t{0xF} << (kEdge * row));
          }
        }
      }
    }
  }
}

NeighbourMoments LocalMap::gather(const Eigen::Vector3d& query, double radius) const {
  const Lanes radius2 = all_lanes(static_cast<float>(radius * radius));
  LaneMask count{};
  Lanes scan{};
  Lanes x{}, y{}, z{};
  Lanes xx{}, xy{}, xz{}, yy{}, yz{}, zz{};
  for_each_row(query, radius, [&](const Row& row, std::uint32_t lanes, const Eigen::Vector3f& local) {
    Lanes dx = load(row.x) - all_lanes(local.x());
    Lanes dy = load(row.y) - all_lanes(local.y());
    Lanes dz = load(row.z) - all_lanes(local.z());
    const LaneMask near = (dx * dx + dy * dy + dz * dz <= radius2) & std::bit_cast<LaneMask>(kLaneMasks[lanes]);
    dx = near ? dx : Lanes{};
    dy = near ? dy : Lanes{};
    dz = near ? dz : Lanes{};
    count -= near;
    scan += near ? load(row.scan) : Lanes{};
    x += dx;
    y += dy;
    z += dz;
    xx += dx * dx;
    xy += dx * dy;
    xz += dx * dz;
    yy += dy * dy;
    yz += dy * dz;
    zz += dz * dz;
  });
  NeighbourMoments moments;
  moments.count = count[0] + count[1] + count[2] + count[3];
  moments.scan_sum = sum(scan);
  moments.sum << sum(x), sum(y), sum(z);
  moments.sum_outer << sum(xx), sum(xy), sum(xz), sum(xy), sum(yy), sum(yz), sum(xz), sum(yz), sum(zz);
  return moments;
}

std::optional<Eigen::Vector3d> LocalMap::nearest(const Eigen::Vector3d& query, double radius) const {
  std::optional<Eigen::Vector3f> best;
  auto best2 = static_cast<float>(radius * radius);
  for_each_row(query, radius, [&](const Row& row, std::uint32_t lanes, const Eigen::Vector3f& local) {
    for (; lanes != 0; lanes &= lanes - 1) {
      const int lane = std::countr_zero(lanes);
      const Eigen::Vector3f offset = Eigen::Vector3f(row.x[lane], row.y[lane], row.z[lane]) - local;
      if (offset.squaredNorm() > best2) continue;
      best = offset;
      best2 = offset.squaredNorm();
    }
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
      const Eigen::Vector3d point = corner + block.point(bit).cast<double>();
      if (((point - position).cwiseAbs().array() <= window.array()).all()) continue;
      block.occupied &= ~(std::uint64_t{1} << bit);
      block.confirmed &= ~(std::uint64_t{1} << bit);
      --size_;
    }
  }
  std::erase_if(blocks_, [](const Block& block) { return block.occupied == 0; });
  rebuild_regions();
}

std::vector<Eigen::Vector3d> LocalMap::points() const {
  std::vector<Eigen::Vector3d> all;
  all.reserve(static_cast<std::size_t>(size_));
  for (const Block& block : blocks_) {
    const Eigen::Vector3d corner = kEdge * voxel_size_ * block.coordinate.cast<double>();
    for (std::uint64_t left = block.occupied; left != 0; left &= left - 1) {
      all.push_back(corner + block.point(std::countr_zero(left)).cast<double>());
    }
  }
  return all;
}

}  // namespace ignis
