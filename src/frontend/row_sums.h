// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "frontend/plane_fit.h"

namespace ignis {

/// Which points count: those seen from anywhere, or from one side of a plane only.
enum class Sides { kAny, kOne };

/// Adds up what rows of four voxels say about the neighbourhood of a query, four voxels at a time: one register of any
/// 64-bit x86 or ARM. NeighbourMoments::add is the reference.
template <Sides kSides>
class RowSums {
 public:
  /// Of the points within `radius` [m]; with Sides::kOne of those that were seen from the side that `side` points to,
  /// or from any where that is zero.
  explicit RowSums(double radius, const Eigen::Vector3f& side = Eigen::Vector3f::Zero())
      : radius2_(all(static_cast<float>(radius * radius))), side_(side) {}

  /// `row` has four each of x, y, z [m], `weight`, `scan` and the direction `view_x` to `view_z`; bit k of `lanes` says
  /// that its voxel k counts. `query` in the row's frame.
  void add(const auto& row, std::uint32_t lanes, const Eigen::Vector3f& query) {
    Lanes dx = load(row.x) - all(query.x());
    Lanes dy = load(row.y) - all(query.y());
    Lanes dz = load(row.z) - all(query.z());
    const Lanes view_x = load(row.view_x);
    const Lanes view_y = load(row.view_y);
    const Lanes view_z = load(row.view_z);
    LaneMask near = (dx * dx + dy * dy + dz * dz <= radius2_) & std::bit_cast<LaneMask>(kMasks[lanes]);
    if constexpr (kSides == Sides::kOne) {
      near &= view_x * all(side_.x()) + view_y * all(side_.y()) + view_z * all(side_.z()) >= Lanes{};
    }
    const Lanes weight = near ? load(row.weight) : Lanes{};
    count_ -= near;
    weight_ += weight;
    scan_ += weight * load(row.scan);
    view_x_ += weight * view_x;
    view_y_ += weight * view_y;
    view_z_ += weight * view_z;
    const Lanes wx = weight * dx;
    const Lanes wy = weight * dy;
    const Lanes wz = weight * dz;
    x_ += wx;
    y_ += wy;
    z_ += wz;
    xx_ += wx * dx;
    xy_ += wx * dy;
    xz_ += wx * dz;
    yy_ += wy * dy;
    yz_ += wy * dz;
    zz_ += wz * dz;
  }

  [[nodiscard]] NeighbourMoments moments() const {
    NeighbourMoments moments;
    moments.count = count_[0] + count_[1] + count_[2] + count_[3];
    moments.weight = sum(weight_);
    moments.scan_sum = sum(scan_);
    moments.view_sum << sum(view_x_), sum(view_y_), sum(view_z_);
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
  Eigen::Vector3f side_;
  LaneMask count_{};
  Lanes weight_{}, scan_{};
  Lanes view_x_{}, view_y_{}, view_z_{};
  Lanes x_{}, y_{}, z_{};
  Lanes xx_{}, xy_{}, xz_{}, yy_{}, yz_{}, zz_{};
};

}  // namespace ignis
