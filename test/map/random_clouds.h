// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>
#include <vector>

#include "common/frames.h"
#include "common/measurements.h"
#include "common/pose.h"

namespace ignis::test {

/// Points spread evenly over a cylinder of the given radius and half height about the body origin [m].
inline std::vector<CloudPoint> random_cloud(std::mt19937& generator, std::size_t count, double radius,
                                            double half_height) {
  std::uniform_real_distribution<double> horizontal(-radius, radius);
  std::uniform_real_distribution<double> vertical(-half_height, half_height);
  std::uniform_real_distribution<float> intensity(0.0F, 255.0F);
  std::vector<CloudPoint> cloud;
  while (cloud.size() < count) {
    const Eigen::Vector3d p(horizontal(generator), vertical(generator), horizontal(generator));
    if (std::hypot(p.x(), p.z()) < radius) cloud.push_back({p.cast<float>(), intensity(generator)});
  }
  return cloud;
}

inline Pose pose_at(double x, double y, double z, double yaw = 0.0) {
  return {frames::from_yaw_pitch_roll({yaw, 0.0, 0.0}), {x, y, z}};
}

}  // namespace ignis::test
