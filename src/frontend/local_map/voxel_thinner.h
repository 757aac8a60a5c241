// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace ignis {

/// Picks one point per cubic voxel of a cloud: the one nearest the voxel's centre. Its memory is kept from cloud to
/// cloud, so that a stream of scans soon asks for none.
///
/// The voxels of a cloud stand in a list; a table of their numbers, open addressing and at most a quarter full, finds
/// them by place. Numbers go on from cloud to cloud, so that those of earlier clouds count as free and nothing is
/// cleared. A scan passes 130,000 points by here, so what decides is how seldom the processor waits: for lines of the
/// table, which are asked for a batch ahead, and for jumps foreseen wrongly, of which one is left.
class VoxelThinner {
 public:
  /// A voxel that points fell into.
  struct Picked {
    std::uint64_t key = 0;    ///< its place
    float distance2 = 0.0F;   ///< [m^2] of the picked point from its centre
    std::int32_t point = -1;  ///< index of the picked point
  };

  /// One for each voxel, in the order in which they first appear; valid until the next call. Only points that `accepts`
  /// says yes to take part; their positions must be finite.
  template <class Point, class Accepts>
  [[nodiscard]] std::span<const Picked> pick(std::span<const Point> cloud, double voxel_size_m,
                                             const Accepts& accepts) {
    begin();
    const auto edge = static_cast<float>(voxel_size_m);
    const float per_metre = 1.0F / edge;
    std::array<Picked, kBatch> batch;
    for (std::size_t next = 0; next < cloud.size();) {
      std::size_t filled = 0;
      for (; next < cloud.size() && filled < kBatch; ++next) {
        if (!accepts(cloud[next])) continue;
        batch[filled] = candidate(cloud[next].position, edge, per_metre, static_cast<std::int32_t>(next));
        __builtin_prefetch(&numbers_[slot_of(batch[filled].key)]);
        ++filled;
      }
      enter(std::span(batch).first(filled));
    }
    return std::span(voxels_).first(static_cast<std::size_t>(count_));
  }

  template <class Point>
  [[nodiscard]] std::span<const Picked> pick(std::span<const Point> cloud, double voxel_size_m) {
    return pick(cloud, voxel_size_m, [](const Point&) { return true; });
  }

 private:
  static constexpr std::size_t kBatch = 64;
  static constexpr int kFirstBits = 12;

  // x, y, z and nothing side by side: one register of any 64-bit x86 or ARM.
  using Lanes = float __attribute__((vector_size(16)));
  using Cells = std::int32_t __attribute__((vector_size(16)));

  [[nodiscard]] static Picked candidate(const Eigen::Vector3f& position, float edge, float per_metre,
                                        std::int32_t point) {
    const Lanes at = {position.x(), position.y(), position.z(), 0.0F};
    const Lanes scaled = at * per_metre;
    Cells voxel = __builtin_convertvector(scaled, Cells);     // towards zero
    voxel += scaled < __builtin_convertvector(voxel, Lanes);  // true is -1
    const Lanes offset = at - edge * (__builtin_convertvector(voxel, Lanes) + 0.5F);
    const Lanes squares = offset * offset;
    return {key_of(voxel), squares[0] + (squares[1] + squares[2]), point};
  }

  /// 21 bits per axis: +-1 million voxels, far beyond any sensor's range.
  [[nodiscard]] static std::uint64_t key_of(const Cells& voxel) {
    constexpr std::uint64_t kMask = (std::uint64_t{1} << 21) - 1;
    return (static_cast<std::uint64_t>(voxel[0]) & kMask) | ((static_cast<std::uint64_t>(voxel[1]) & kMask) << 21) |
           (static_cast<std::uint64_t>(voxel[2]) << 42);
  }

  /// Only the highest bits of the product depend on all bits of the key: lower ones know nothing of z, and the voxels
  /// of a whole row would share a slot.
  [[nodiscard]] std::size_t slot_of(std::uint64_t key) const {
    return static_cast<std::size_t>(((key ^ (key >> 32)) * 0x9E3779B97F4A7C15ULL) >> (64 - bits_));
  }

  void begin() {
    if (numbers_.empty() || first_ > std::numeric_limits<std::int32_t>::max() / 2) {
      first_ = 0;
      resize(std::max(bits_, kFirstBits));
    } else {
      first_ += count_;
    }
    count_ = 0;
  }

  /// A candidate as a voxel of its own stands behind the list and is what a free slot leads to: new voxels and known
  /// ones, which come as they like, take the same way.
  void enter(std::span<const Picked> candidates) {
    while (static_cast<std::size_t>(count_) + candidates.size() >= voxels_.size()) grow();
    Picked* const voxels = voxels_.data();
    std::int32_t* const numbers = numbers_.data();
    const std::size_t last = numbers_.size() - 1;
    const std::int32_t first = first_;
    std::int32_t count = count_;
    const auto index_in = [&](std::size_t slot) {
      const std::int32_t index = numbers[slot] - first;
      const std::int32_t is_free = index >> 31;  // all ones; as a condition the compiler would make it a jump
      return (index & ~is_free) | (count & is_free);
    };
    for (const Picked& candidate : candidates) {
      voxels[count] = {candidate.key, std::numeric_limits<float>::infinity(), -1};
      std::size_t slot = slot_of(candidate.key);
      std::int32_t index = index_in(slot);
      while (voxels[index].key != candidate.key) {
        slot = (slot + 1) & last;
        index = index_in(slot);
      }
      Picked& voxel = voxels[index];
      voxel.point = candidate.distance2 < voxel.distance2 ? candidate.point : voxel.point;
      voxel.distance2 = std::min(candidate.distance2, voxel.distance2);
      numbers[slot] = first + index;
      count += index == count ? 1 : 0;
    }
    count_ = count;
  }

  void grow() {
    resize(bits_ + 1);
    for (std::int32_t i = 0; i < count_; ++i) {
      std::size_t slot = slot_of(voxels_[static_cast<std::size_t>(i)].key);
      while (numbers_[slot] >= first_) slot = (slot + 1) & (numbers_.size() - 1);
      numbers_[slot] = first_ + i;
    }
  }

  void resize(int bits) {
    bits_ = bits;
    numbers_.assign(std::size_t{1} << bits, -1);
    voxels_.resize(numbers_.size() / 4);
  }

  std::vector<std::int32_t> numbers_;  ///< [slot] of the voxel there, counted over all clouds
  std::vector<Picked> voxels_;         ///< of this cloud, and room for one more
  int bits_ = 0;                       ///< numbers_ has 2^bits_
  std::int32_t first_ = 0;             ///< number of this cloud's first voxel
  std::int32_t count_ = 0;             ///< of this cloud's voxels
};

}  // namespace ignis
