// SPDX-License-Identifier: Apache-2.0
#include "common/extrinsics.h"

#include <cmath>

#include <gtest/gtest.h>

namespace ignis {
namespace {

TEST(Mount, ForwardTiltTurnsTheSensorsUpTowardsTheFront) {
  Mount mount;
  mount.pitch_deg = -45.0;
  const Eigen::Vector3d up_of_sensor = mount.T_body_sensor().rotation * Eigen::Vector3d::UnitZ();
  const double half = std::sqrt(0.5);
  EXPECT_LT((up_of_sensor - Eigen::Vector3d(0.0, half, -half)).norm(), 1e-12);
}

TEST(Mount, TranslationIsTheSensorsOriginInTheBodyFrame) {
  Mount mount;
  mount.yaw_deg = 90.0;
  mount.translation_m = {0.1, 0.2, 0.3};
  EXPECT_LT((mount.T_body_sensor() * Eigen::Vector3d::Zero() - Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-12);
}

TEST(Mount, OwnAxesNeedNoTurn) {
  Mount mount;
  mount.axes = "right_up_back";
  EXPECT_LT((mount.T_body_sensor() * Eigen::Vector3d(1, 2, 3) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
}

}  // namespace
}  // namespace ignis
