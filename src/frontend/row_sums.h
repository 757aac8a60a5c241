// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "frontend/plane_fit.h"

namespace ignis {

/// Adds up what rows of four voxels say about the neighbourhood of a query, four voxels at a time: one register of any
/// 64-bit x86 or ARM. NeighbourMoments::add is the reference.
class RowSums {
 public:
  /// Of the points within `radius` [m].
  explicit RowSums(double radius) : radius2_(all(static_cast<float>(radius * radius))) {}

  /// `row` has four x, y, z [m] and `scan`; bit k of `lanes` says that its voxel k counts. `query` in the row's frame.
  void add(const auto& row, std::uint32_t lanes, const Eigen::Vector3f& query) {
    Lanes dx = load(row.x) - all(query.x());
    Lanes dy = load(row.y) - all(query.y());
    Lanes dz = load(row.z) - all(query.z());
    const LaneMask near = (dx * dx + dy * dy + dz * dz <= radius2_) & std::bit_cast<LaneMask>(kMasks[lanes]);
    dx = near ? dx : Lanes{};
    dy = near ? dy : Lanes{};
    dz = near ? dz : Lanes{};
    count_ -= near;
    scan_ += near ? load(row.scan) : Lanes{};
    x_ += dx;
    y_ += dy;
    z_ += dz;
    xx_ += dx * dx;
    xy_ += dx * dy;
    xz_ += dx * dz;
    yy_ += dy * dy;
    yz_ += dy * dz;
    zz_ += dz * dz;
  }

  [[nodiscard]] NeighbourMoments moments() const {
    NeighbourMoments moments;
    moments.count = count_[0] + count_[1] + count_[2] + count_[3];
    moments.scan_sum = sum(scan_);
    moments.sum << sum(x_), sum(y_), sum(z_);
    moments.sum_outer << sum(xx_), sum(xy_), sum(xz_), sum(xy_), sum(yy_), sum(yz_), sum(xz_), sum(yz_), sum(zz_);
    return moments;
  }

 private:
  using Lanes = float __attribute__((vector_size(16)));
  using LaneMask = std::int32_t __attribute__((vector_size(16)));
  using Masks = std::array<std::array<std::int32_t, 4>, 16>;

  /// [n]: lane k is chosen when bit k of n is set.
  alignas(16) static constexpr Masks kMasks = [] {
    Masks masks{};
    for (std::size_t n = 0; n < 16; ++n) {
      for (std::size_t k = 0; k < 4; ++k) masks[n][k] = (n >> k & 1U) != 0 ? -1 : 0;
    }
    return masks;
  }();

  [[nodiscard]] static Lanes all(float value) { return Lanes{value, value, value, value}; }
  [[nodiscard]] static Lanes load(const float (&values)[4]) { return std::bit_cast<Lanes>(values); }
  [[nodiscard]] static double sum(Lanes lanes) {
    return static_cast<double>((lanes[0] + lanes[1]) + (lanes[2] + lanes[3]));
  }

  Lanes radius2_;
  LaneMask count_{};
  Lanes scan_{};
  Lanes x_{}, y_{}, z_{};
  Lanes xx_{}, xy_{}, xz_{}, yy_{}, yz_{}, zz_{};
};

}  // namespace ignis
