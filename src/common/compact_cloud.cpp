// SPDX-License-Identifier: Apache-2.0
#include "common/compact_cloud.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ignis {
namespace {

constexpr double kFinestResolution = 0.001;  // [m]

}  // namespace

float resolution_for(std::span<const CloudPoint> cloud) {
  float reach = 0.0F;
  for (const CloudPoint& point : cloud) {
    if (point.position.allFinite()) reach = std::max(reach, point.position.cwiseAbs().maxCoeff());
  }
  const double needed = static_cast<double>(reach) / std::numeric_limits<std::int16_t>::max();
  return static_cast<float>(kFinestResolution * std::max(1.0, std::ceil(needed / kFinestResolution)));
}

CompactCloud compact(std::span<const CloudPoint> cloud) {
  CompactCloud small;
  small.resolution_m = resolution_for(cloud);
  small.counts.resize(std::ranges::count_if(cloud, [](const CloudPoint& point) { return point.position.allFinite(); }),
                      3);
  Eigen::Index row = 0;
  for (const CloudPoint& point : cloud) {
    if (!point.position.allFinite()) continue;
    small.counts.row(row++) =
        (point.position / small.resolution_m).array().round().cast<std::int16_t>().matrix().transpose();
  }
  return small;
}

std::vector<CloudPoint> expanded(const CompactCloud& cloud) {
  std::vector<CloudPoint> points;
  points.reserve(cloud.size());
  for (Eigen::Index row = 0; row < cloud.counts.rows(); ++row) {
    const Eigen::Vector3f counts = cloud.counts.row(row).transpose().cast<float>();
    points.push_back({.position = counts * cloud.resolution_m, .intensity = 0.0F});
  }
  return points;
}

}  // namespace ignis
