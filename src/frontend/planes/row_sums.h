// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "frontend/planes/lanes.h"
#include "frontend/planes/plane_fit.h"

namespace ignis {

/// Which points count: those seen from anywhere, or from one side of a plane only.
enum class Sides { kAny, kOne };

/// NeighbourMoments of four queries, in single precision, each quantity in a register of its own.
struct FourMoments {
  Lanes count{};
  Lanes weight{};
  Lanes scan_sum{};
  std::array<Lanes, 3> view_sum{};
  std::array<Lanes, 3> sum{};
  std::array<Lanes, 6> sum_outer{};  ///< xx, xy, xz, yy, yz, zz

  [[nodiscard]] NeighbourMoments of(int query) const {
    NeighbourMoments moments;
    moments.count = static_cast<int>(count[query]);
    moments.weight = weight[query];
    moments.scan_sum = scan_sum[query];
    moments.view_sum << view_sum[0][query], view_sum[1][query], view_sum[2][query];
    moments.sum << sum[0][query], sum[1][query], sum[2][query];
    const auto& o = sum_outer;
    moments.sum_outer << o[0][query], o[1][query], o[2][query], o[1][query], o[3][query], o[4][query], o[2][query],
        o[4][query], o[5][query];
    return moments;
  }
};

/// Adds up what rows of four voxels say about the neighbourhood of a query, four voxels at a time.
/// NeighbourMoments::add is the reference.
template <Sides kSides>
class RowSums {
 public:
  RowSums() : RowSums(0.0) {}
  /// Of the points within `radius` [m]; with Sides::kOne of those that were seen from the side that `side` points to,
  /// or from any where that is zero.
  explicit RowSums(double radius, const Eigen::Vector3f& side = Eigen::Vector3f::Zero())
      : radius2_(all(static_cast<float>(radius * radius))), side_(side) {}

  /// `row` has four each of x, y, z [m], `weight`, `scan` and the direction `view_x` to `view_z`; bit k of `lanes` says
  /// that its voxel k counts. `query` in the row's frame.
  void add(const auto& row, std::uint32_t lanes, const Eigen::Vector3f& query) {
    const Lanes dx = load(row.x) - all(query.x());
    const Lanes dy = load(row.y) - all(query.y());
    const Lanes dz = load(row.z) - all(query.z());
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

  /// What four of them come to.
  [[nodiscard]] static FourMoments moments(const std::array<RowSums, kLanes>& four) {
    const auto sum = [&](Lanes RowSums::* quantity) {
      return sums_of(four[0].*quantity, four[1].*quantity, four[2].*quantity, four[3].*quantity);
    };
    FourMoments moments;
    for (int k = 0; k < kLanes; ++k) {
      const LaneMask& count = four[static_cast<std::size_t>(k)].count_;
      moments.count[k] = static_cast<float>(count[0] + count[1] + count[2] + count[3]);
    }
    moments.weight = sum(&RowSums::weight_);
    moments.scan_sum = sum(&RowSums::scan_);
    moments.view_sum = {sum(&RowSums::view_x_), sum(&RowSums::view_y_), sum(&RowSums::view_z_)};
    moments.sum = {sum(&RowSums::x_), sum(&RowSums::y_), sum(&RowSums::z_)};
    moments.sum_outer = {sum(&RowSums::xx_), sum(&RowSums::xy_), sum(&RowSums::xz_),
                         sum(&RowSums::yy_), sum(&RowSums::yz_), sum(&RowSums::zz_)};
    return moments;
  }

 private:
  using Masks = std::array<std::array<std::int32_t, 4>, 16>;

  /// [n]: lane k is chosen when bit k of n is set.
  alignas(16) static constexpr Masks kMasks = [] {
    Masks masks{};
    for (std::size_t n = 0; n < 16; ++n) {
      for (std::size_t k = 0; k < 4; ++k) masks[n][k] = (n >> k & 1U) != 0 ? -1 : 0;
    }
    return masks;
  }();

  [[nodiscard]] static Lanes load(const float (&values)[4]) { return std::bit_cast<Lanes>(values); }

  Lanes radius2_;
  Eigen::Vector3f side_;
  LaneMask count_{};
  Lanes weight_{}, scan_{};
  Lanes view_x_{}, view_y_{}, view_z_{};
  Lanes x_{}, y_{}, z_{};
  Lanes xx_{}, xy_{}, xz_{}, yy_{}, yz_{}, zz_{};
};

}  // namespace ignis
