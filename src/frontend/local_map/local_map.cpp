// SPDX-License-Identifier: Apache-2.0
#include "frontend/local_map/local_map.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "frontend/local_map/local_map_walk.h"
#include "frontend/planes/row_sums.h"

namespace ignis {
namespace {

using cubes::bit_of;
using cubes::cube_of;
using cubes::voxel_of;

constexpr std::int32_t kFree = -1;
constexpr std::size_t kFirstCapacity = 256;

}  // namespace

LocalMap::LocalMap(const FrontendConfig& config)
    : voxel_size_(config.voxel_size_m),
      match_radius_(config.match_radius_m),
      window_(config.map_window_m),
      window_y_(config.map_window_y),
      memory_(std::max(config.map_memory_m, config.map_window_m)),
      average_points_(static_cast<float>(config.map_average_points)),
      two_faces_(config.map_two_faces) {
  config::require_valid(config, "frontend");
  clear();
}

Eigen::Vector3f LocalMap::Block::point(int bit) const {
  const Row& row = rows[bit / kEdge];
  const int lane = bit % kEdge;
  return {row.x[lane], row.y[lane], row.z[lane]};
}

LocalMap::Voxel LocalMap::Block::voxel(int bit) const {
  const Row& row = rows[bit / kEdge];
  const int lane = bit % kEdge;
  return {point(bit), row.weight[lane], row.scan[lane], {row.view_x[lane], row.view_y[lane], row.view_z[lane]}};
}

void LocalMap::Block::set_voxel(int bit, const Voxel& voxel) {
  Row& row = rows[bit / kEdge];
  const int lane = bit % kEdge;
  row.x[lane] = voxel.point.x();
  row.y[lane] = voxel.point.y();
  row.z[lane] = voxel.point.z();
  row.weight[lane] = voxel.weight;
  row.scan[lane] = voxel.scan;
  row.view_x[lane] = voxel.view.x();
  row.view_y[lane] = voxel.view.y();
  row.view_z[lane] = voxel.view.z();
}

void LocalMap::clear() {
  blocks_.clear();
  regions_.clear();
  table_.assign(kFirstCapacity, kFree);
  size_ = 0;
  scans_ = 0;
  inserted_points_ = 0;
  has_slid_ = false;
  sure_since_ = 0;
  unswept_ = 0;
  sweep_step_ = 0;
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

std::int32_t LocalMap::find_or_add_block(const Eigen::Vector3i& coordinate, std::uint32_t face) {
  const Eigen::Vector3i parent = cube_of(coordinate);
  const int bit = bit_of(coordinate - kEdge * parent);
  // A scan stays in a region for some blocks before it goes on to the next.
  if (newest_region_ >= regions_.size() || regions_[newest_region_].coordinate != parent) {
    newest_region_ = static_cast<std::size_t>(&find_or_add_region(parent) - regions_.data());
  }
  Region& region = regions_[newest_region_];
  if (!region.has(face, bit)) {
    region.put(face, bit, blocks_.size());
    Block& added = blocks_.emplace_back();
    added.coordinate = coordinate;
    added.face = face;
  }
  return region.blocks[face][bit];
}

void LocalMap::rebuild_table(std::size_t capacity) {
  table_.assign(capacity, kFree);
  for (std::size_t i = 0; i < regions_.size(); ++i) {
    std::size_t slot = slot_of(regions_[i].coordinate);
    while (table_[slot] != kFree) slot = (slot + 1) & (table_.size() - 1);
    table_[slot] = static_cast<std::int32_t>(i);
  }
}

/// The regions of all blocks, anew.
void LocalMap::rebuild_regions() {
  regions_.clear();
  table_.assign(kFirstCapacity, kFree);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const auto [region, bit] = home_of(blocks_[i]);
    region->put(blocks_[i].face, bit, i);
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
        block = find_or_add_block(coordinate, 0);
        block_at = coordinate;
        corner = kEdge * voxel_size_ * coordinate.cast<double>();
      }
      const Eigen::Vector3d view = (T_odom_body.translation - point).normalized();
      places[i] = {(point - corner).cast<float>(), view.cast<float>(), block, bit_of(voxel - kEdge * coordinate)};
      const Block& there = blocks_[static_cast<std::size_t>(block)];
      __builtin_prefetch(&there.rows[places[i].bit / kEdge].x);
      __builtin_prefetch(&there.rows[places[i].bit / kEdge].scan);
      __builtin_prefetch(&there.occupied);
    }
    for (const Place& place : std::span(places).first(count)) insert_point(place, confirmed);
    points = points.subspan(count);
  }
}

std::int32_t LocalMap::block_of_face(const Place& place) {
  const auto is_taken = [&](const Block& block) { return (block.occupied >> place.bit & 1U) != 0; };
  const auto agrees = [&](const Block& block) { return block.voxel(place.bit).view.dot(place.view) >= 0.0F; };
  const Block& first = blocks_[static_cast<std::size_t>(place.block)];
  if (is_taken(first) && agrees(first)) return place.block;
  if (is_taken(first)) {
    const Eigen::Vector3i coordinate = first.coordinate;  // a copy: a new block may move the others
    return find_or_add_block(coordinate, 1);
  }
  // The first may have left the window, the second not.
  const auto [region, bit] = home_of(first);
  if (!region->has(1, bit)) return place.block;
  const std::int32_t second = region->blocks[1][bit];
  const Block& other = blocks_[static_cast<std::size_t>(second)];
  return is_taken(other) && agrees(other) ? second : place.block;
}

void LocalMap::insert_point(const Place& place, bool confirmed) {
  Block& block = blocks_[static_cast<std::size_t>(two_faces_ ? block_of_face(place) : place.block)];
  const int bit = place.bit;
  const std::uint64_t flag = std::uint64_t{1} << bit;
  const auto scan = static_cast<float>(scans_);
  const bool taken = (block.occupied & flag) != 0;
  const bool taken_confirmed = (block.confirmed & flag) != 0;
  if (taken_confirmed && !confirmed) return;
  const bool merges = taken && taken_confirmed == confirmed;
  if (merges && average_points_ > 1) {
    Voxel voxel = block.voxel(bit);
    voxel.weight = std::min(voxel.weight + 1.0F, average_points_);
    const float share = 1.0F / voxel.weight;
    voxel.point += share * (place.local - voxel.point);
    voxel.scan += share * (scan - voxel.scan);
    voxel.view += share * (place.view - voxel.view);
    block.set_voxel(bit, voxel);
    return;
  }
  if (merges && !nearer_to_centre(place.local, block.point(bit), bit)) return;
  if (!taken) ++size_;
  block.set_voxel(bit, {place.local, 1.0F, scan, place.view});
  block.occupied |= flag;
  if (confirmed) block.confirmed |= flag;
}

bool LocalMap::nearer_to_centre(const Eigen::Vector3f& point, const Eigen::Vector3f& stored, int bit) const {
  const Eigen::Vector3i inside(bit % kEdge, bit / kEdge % kEdge, bit / (kEdge * kEdge));
  const Eigen::Vector3f centre = ((inside.cast<double>().array() + 0.5) * voxel_size_).matrix().cast<float>();
  return (point - centre).squaredNorm() < (stored - centre).squaredNorm();
}

NeighbourMoments LocalMap::gather(const Eigen::Vector3d& query, double radius, const Eigen::Vector3d& side) const {
  const Box box = box_around(query, radius);
  RowSums<Sides::kOne> sums(radius, side.cast<float>());
  for_each_block(box, [&](const Block& block) {
    const Eigen::Vector3f local = relative_to(block, query);
    for_each_row(block, box, [&](const Row& row, std::uint32_t lanes) { sums.add(row, lanes, local); });
  });
  return RowSums<Sides::kOne>::moments({sums}).of(0);
}

std::optional<Eigen::Vector3d> LocalMap::nearest(const Eigen::Vector3d& query, double radius) const {
  std::optional<Eigen::Vector3f> best;
  auto best2 = static_cast<float>(radius * radius);
  const Box box = box_around(query, radius);
  for_each_block(box, [&](const Block& block) {
    const Eigen::Vector3f local = relative_to(block, query);
    for_each_row(block, box, [&](const Row& row, std::uint32_t lanes) {
      for (; lanes != 0; lanes &= lanes - 1) {
        const int lane = std::countr_zero(lanes);
        const Eigen::Vector3f offset = Eigen::Vector3f(row.x[lane], row.y[lane], row.z[lane]) - local;
        if (offset.squaredNorm() > best2) continue;
        best = offset;
        best2 = offset.squaredNorm();
      }
    });
  });
  if (!best) return std::nullopt;
  return query + best->cast<double>();
}

std::optional<Eigen::Vector3d> LocalMap::own_voxel(const Eigen::Vector3d& query, float min_points,
                                                   const Eigen::Vector3d& side) const {
  const Eigen::Vector3i voxel = voxel_of(query, voxel_size_);
  const Eigen::Vector3i coordinate = cube_of(voxel);
  const Eigen::Vector3i parent = cube_of(coordinate);
  const Region* region = find_region(parent);
  const int block_bit = bit_of(coordinate - kEdge * parent);
  const int bit = bit_of(voxel - kEdge * coordinate);
  for (std::uint32_t face = 0; region != nullptr && face < kFaces; ++face) {
    if (!region->has(face, block_bit)) continue;
    const Block& block = blocks_[static_cast<std::size_t>(region->blocks[face][block_bit])];
    if ((block.confirmed >> bit & 1U) == 0) continue;
    const Voxel found = block.voxel(bit);
    if (found.weight < min_points || found.view.dot(side.cast<float>()) < 0.0F) continue;
    return kEdge * voxel_size_ * coordinate.cast<double>() + found.point.cast<double>();
  }
  return std::nullopt;
}

void LocalMap::slide(const Eigen::Vector3d& position, int sure_since) {
  if (!has_slid_) {
    has_slid_ = true;
    last_slide_ = position;
  }
  if ((position - last_slide_).norm() >= 0.25 * window_) {
    sweep(unswept_);
    last_slide_ = position;
    sure_since_ = sure_since;
    unswept_ = blocks_.size();
    sweep_step_ = unswept_ / kSlidesToSweep + 1;
  }
  sweep(sweep_step_);
}

/// Looks at the next blocks, from the last to the first, so that what takes the place of a dropped one has been looked
/// at.
void LocalMap::sweep(std::uint64_t blocks) {
  if (unswept_ == 0) return;
  const std::uint64_t until = unswept_ - std::min(unswept_, blocks);
  for (; unswept_ > until; --unswept_) {
    prune(blocks_[unswept_ - 1]);
    if (blocks_[unswept_ - 1].occupied == 0) drop_block(unswept_ - 1);
  }
  if (unswept_ == 0) drop_empty_regions();
}

/// Takes out the voxels that have left the window.
void LocalMap::prune(Block& block) {
  const double edge = kEdge * voxel_size_;
  const Eigen::Vector3d corner = edge * block.coordinate.cast<double>();
  const Eigen::Array3d window(window_, window_y_, window_);
  const Eigen::Array3d memory(memory_, window_y_, memory_);
  const Eigen::Array3d near = (corner - last_slide_).array();
  const Eigen::Array3d farthest = near.abs().max((near + edge).abs());
  if ((farthest <= window).all()) return;  // none of its voxels has to be read
  const auto sure_since = static_cast<float>(sure_since_);
  if (block.oldest >= sure_since && (farthest <= memory).all()) return;
  block.oldest = static_cast<float>(scans_);
  for (std::uint64_t left = block.occupied; left != 0; left &= left - 1) {
    const int bit = std::countr_zero(left);
    const Voxel voxel = block.voxel(bit);
    const Eigen::Array3d offset = (corner + voxel.point.cast<double>() - last_slide_).cwiseAbs().array();
    const bool sure = voxel.scan >= sure_since;
    if ((offset <= (sure ? memory : window)).all()) {
      block.oldest = std::min(block.oldest, voxel.scan);
      continue;
    }
    block.occupied &= ~(std::uint64_t{1} << bit);
    block.confirmed &= ~(std::uint64_t{1} << bit);
    --size_;
  }
}

/// The last block takes its place.
void LocalMap::drop_block(std::size_t index) {
  const auto [region, bit] = home_of(blocks_[index]);
  region->present[blocks_[index].face] &= ~(std::uint64_t{1} << bit);
  if (index + 1 != blocks_.size()) {
    blocks_[index] = blocks_.back();
    const auto [moved_region, moved_bit] = home_of(blocks_[index]);
    moved_region->put(blocks_[index].face, moved_bit, index);
  }
  blocks_.pop_back();
}

LocalMap::Home LocalMap::home_of(const Block& block) {
  const Eigen::Vector3i parent = cube_of(block.coordinate);
  return {&find_or_add_region(parent), bit_of(block.coordinate - kEdge * parent)};
}

void LocalMap::drop_empty_regions() {
  std::erase_if(regions_, [](const Region& region) { return (region.present[0] | region.present[1]) == 0; });
  rebuild_table(table_.size());
}

std::vector<Eigen::Vector3d> LocalMap::confirmed_near(const Eigen::Vector3d& lo, const Eigen::Vector3d& hi) const {
  const double edge = kEdge * voxel_size_;
  std::vector<Eigen::Vector3d> found;
  for (const Block& block : blocks_) {
    const Eigen::Vector3d corner = edge * block.coordinate.cast<double>();
    if ((corner.array() > hi.array()).any() || (corner.array() + edge < lo.array()).any()) continue;
    for (std::uint64_t left = block.confirmed; left != 0; left &= left - 1) {
      found.push_back(corner + block.point(std::countr_zero(left)).cast<double>());
    }
  }
  return found;
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
