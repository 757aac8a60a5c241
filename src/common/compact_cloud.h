// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/byte_codec.h"
#include "common/measurements.h"

namespace ignis {

/// Coordinates as whole multiples of a resolution, one point a row: 6 bytes a point, without intensity.
struct CompactCloud {
  float resolution_m = 0.0F;
  Eigen::Matrix<std::int16_t, Eigen::Dynamic, 3, Eigen::RowMajor> counts;

  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(counts.rows()); }
  [[nodiscard]] std::size_t bytes() const { return 3 * sizeof(std::int16_t) * size(); }
};

/// [m] The millimetre as long as 16 bits reach from the body to the farthest finite coordinate, which is 32.767 m; else
/// the smallest multiple of it with which they do.
[[nodiscard]] float resolution_for(std::span<const CloudPoint> cloud);

/// Each coordinate at the nearest multiple of resolution_for(), so it moves by half of that at most. Points that are
/// not finite are left out.
[[nodiscard]] CompactCloud compact(std::span<const CloudPoint> cloud);

/// The points again, with intensity 0.
[[nodiscard]] std::vector<CloudPoint> expanded(const CompactCloud& cloud);

void transfer(auto& io, FieldsOf<CompactCloud> auto& cloud) {
  io.number(cloud.resolution_m);
  io.matrix(cloud.counts);
}

}  // namespace ignis
