// SPDX-License-Identifier: Apache-2.0
#include "map/keyframe_clouds.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

#include <boost/unordered/unordered_flat_map.hpp>

#include "common/grid.h"
#include "map/tile_grid.h"

namespace ignis {
namespace {

constexpr std::size_t kRoomShare = 16;  // one part in so many of the bound becomes free at a time

CellIndex cell_of(const Eigen::Vector3d& p, double per_metre) {
  return {floor_to_int(p.x() * per_metre), floor_to_int(p.y() * per_metre), floor_to_int(p.z() * per_metre)};
}

/// A point as the map can order it, or nothing: coordinates that it can hold, an intensity that is a number.
std::optional<CloudPoint> sound(const Eigen::Vector3d& p, float intensity) {
  if (!is_within_reach(p)) return std::nullopt;
  return CloudPoint{p.cast<float>(), intensity > 0.0F ? std::min(intensity, 255.0F) : 0.0F};
}

/// The blocks that the points of a cloud lie in, numbered in the order of their keys.
struct BlockNumbers {
  std::vector<CellKey> keys;            ///< [block] ascending
  std::vector<std::uint32_t> sizes;     ///< [block] points
  std::vector<std::uint32_t> of_point;  ///< [point] block
};

BlockNumbers number_blocks(std::span<const CloudPoint> points) {
  BlockNumbers blocks;
  boost::unordered_flat_map<CellKey, std::uint32_t> numbers;  // in the order in which they are met
  blocks.of_point.reserve(points.size());
  for (const CloudPoint& point : points) {
    const CellKey key = pack(cell_of(point.position.cast<double>(), 1.0 / CloudBlock::kEdge));
    const auto [entry, is_new] = numbers.try_emplace(key, static_cast<std::uint32_t>(numbers.size()));
    if (is_new) blocks.keys.push_back(key);
    blocks.of_point.push_back(entry->second);
  }
  std::ranges::sort(blocks.keys);
  std::vector<std::uint32_t> sorted(blocks.keys.size());
  for (std::uint32_t i = 0; i < sorted.size(); ++i) sorted[numbers.at(blocks.keys[i])] = i;
  blocks.sizes.resize(blocks.keys.size());
  for (std::uint32_t& block : blocks.of_point) {
    block = sorted[block];
    ++blocks.sizes[block];
  }
  return blocks;
}

/// Neighbours in space become neighbours in memory, in blocks.
void sort_into_blocks(CloudData& cloud) {
  const BlockNumbers numbers = number_blocks(cloud.points);
  std::uint32_t begin = 0;
  for (std::size_t i = 0; i < numbers.keys.size(); ++i) {
    const CellIndex block = unpack(numbers.keys[i]);
    const Eigen::Vector3d centre =
        CloudBlock::kEdge * (Eigen::Vector3d(block.x, block.y, block.z) + Eigen::Vector3d::Constant(0.5));
    cloud.blocks.push_back({centre.cast<float>(), begin, begin});
    begin += numbers.sizes[i];
  }
  std::vector<CloudPoint> sorted(cloud.points.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    sorted[cloud.blocks[numbers.of_point[i]].end++] = cloud.points[i];
  }
  cloud.points = std::move(sorted);
}

}  // namespace

KeyframeClouds::KeyframeClouds(double cell_m, std::size_t max_points) : cell_m_(cell_m), max_points_(max_points) {}

std::optional<std::int32_t> KeyframeClouds::open_id() const {
  return entries_.empty() ? std::nullopt : std::optional(entries_.rbegin()->first);
}

KeyframeClouds::Kept KeyframeClouds::add_keyframe(std::int32_t id, std::span<const CloudPoint> points_body,
                                                  const Pose& T_odom_keyframe) {
  const bool is_newest = entries_.empty() || id > entries_.rbegin()->first;
  if (is_newest) {
    close_newest();
    entries_[id] = {T_odom_keyframe, nullptr};
    return insert_open(points_body, Pose{}, false);
  }
  auto cloud = std::make_shared<CloudData>();
  std::size_t unusable = 0;
  which_.clear();
  for (std::uint32_t i = 0; i < points_body.size(); ++i) {
    const auto kept = sound(points_body[i].position.cast<double>(), points_body[i].intensity);
    if (!kept) {
      ++unusable;
      continue;
    }
    cloud->points.push_back(*kept);
    which_.push_back(i);
  }
  sort_into_blocks(*cloud);
  closed_points_ += cloud->points.size();
  blocks_ += cloud->blocks.size();
  const std::span<const CloudPoint> kept = cloud->points;
  entries_[id] = {T_odom_keyframe, std::move(cloud)};
  return {id, kept, which_, unusable};
}

KeyframeClouds::Kept KeyframeClouds::add_scan(std::span<const CloudPoint> points_body, const Pose& T_odom_body) {
  if (entries_.empty()) entries_[kBeforeFirst] = {T_odom_body, nullptr};
  return insert_open(points_body, entries_.rbegin()->second.T_odom_keyframe.inverse() * T_odom_body, true);
}

KeyframeClouds::Kept KeyframeClouds::insert_open(std::span<const CloudPoint> points, const Pose& T_keyframe_points,
                                                 bool are_rays) {
  const std::size_t before = open_points_.size();
  const Eigen::Matrix3d R = T_keyframe_points.rotation.normalized().toRotationMatrix();
  const double per_metre = 1.0 / cell_m_;
  std::size_t unusable = 0;
  which_.clear();
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p = R * points[i].position.cast<double>() + T_keyframe_points.translation;
    const auto kept = sound(p, points[i].intensity);
    if (!kept) {
      ++unusable;
      continue;
    }
    // The sensor stands near the body's origin; the few centimetres between are less than a cell.
    if (open_free_ && are_rays) open_free_->add_ray(T_keyframe_points.translation, p);
    if (open_free_ && !are_rays) open_free_->add_hit(p);
    if (open_points_.size() >= max_points_ || !open_cells_.insert(cell_of(p, per_metre))) continue;
    open_points_.push_back(*kept);
    which_.push_back(i);
  }
  return {entries_.rbegin()->first, std::span(open_points_).subspan(before), which_, unusable};
}

void KeyframeClouds::close_newest() {
  if (entries_.empty()) return;
  auto cloud = std::make_shared<CloudData>();
  cloud->points = std::exchange(open_points_, {});
  open_points_.reserve(cloud->points.size());  // the next one will be like it
  sort_into_blocks(*cloud);
  if (open_free_) cloud->free = open_free_->take();
  closed_points_ += cloud->points.size();
  blocks_ += cloud->blocks.size();
  free_cells_ += cloud->free.size();
  entries_.rbegin()->second.cloud = std::move(cloud);
  open_cells_.clear();
}

std::vector<std::int32_t> KeyframeClouds::beyond_bound() const {
  std::vector<std::int32_t> ids;
  if (points() <= max_points_) return ids;
  std::vector<std::pair<double, std::int32_t>> by_distance;
  const Eigen::Vector3d here = entries_.rbegin()->second.T_odom_keyframe.translation;
  for (auto entry = entries_.begin(); entry != std::prev(entries_.end()); ++entry) {
    const Eigen::Vector3d offset = entry->second.T_odom_keyframe.translation - here;
    by_distance.emplace_back(std::hypot(offset.x(), offset.z()), entry->first);
  }
  std::ranges::sort(by_distance, std::greater{});
  std::size_t left = points();
  for (const auto& [distance, id] : by_distance) {
    if (left <= max_points_ - max_points_ / kRoomShare) break;
    left -= entries_.at(id).cloud->points.size();
    ids.push_back(id);
  }
  return ids;
}

void KeyframeClouds::drop(std::span<const std::int32_t> ids) {
  for (const std::int32_t id : ids) {
    const auto entry = entries_.find(id);
    closed_points_ -= entry->second.cloud->points.size();
    blocks_ -= entry->second.cloud->blocks.size();
    free_cells_ -= entry->second.cloud->free.size();
    entries_.erase(entry);
    ++dropped_;
  }
}

void KeyframeClouds::clear() {
  entries_.clear();
  open_points_ = {};
  open_cells_.clear();
  if (open_free_) std::ignore = open_free_->take();
  closed_points_ = blocks_ = free_cells_ = 0;
  dropped_ = 0;
}

std::size_t KeyframeClouds::bytes() const {
  return points() * sizeof(CloudPoint) + blocks_ * sizeof(CloudBlock) + open_cells_.bytes() +
         entries_.size() * sizeof(decltype(entries_)::value_type) + free_cells_ * sizeof(FreeCell) +
         (open_free_ ? open_free_->bytes() : 0);
}

StoredCloud KeyframeClouds::view(std::int32_t id) const {
  const Entry& entry = entries_.at(id);
  return entry.cloud ? view_of(*entry.cloud) : StoredCloud{open_points_, {}, {}};
}

SharedCloud KeyframeClouds::share(std::int32_t id) const {
  const Entry& entry = entries_.at(id);
  return entry.cloud ? entry.cloud : std::make_shared<const CloudData>(CloudData{open_points_, {}, {}});
}

}  // namespace ignis
