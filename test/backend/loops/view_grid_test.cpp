// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/view_grid.h"

#include <gtest/gtest.h>

#include <limits>

namespace ignis {
namespace {

constexpr double kCell = 0.05;  // [rad]

CloudPoint point_at(float x, float y, float z) { return {{x, y, z}, 0.0F}; }

TEST(ViewGrid, ShowsWhatStandsInFrontOfTheNearestPointAndHidesWhatIsBehind) {
  const std::vector<CloudPoint> cloud = {point_at(0, 0, -5), point_at(0, 0, -9), point_at(3, 1, 2),
                                         point_at(std::numeric_limits<float>::quiet_NaN(), 0, -1)};
  const ViewGrid view(cloud, kCell);
  EXPECT_TRUE(view.would_show({0.0, 0.0, -2.0}, 0.3));
  EXPECT_TRUE(view.would_show({0.0, 0.0, -5.2}, 0.3));
  EXPECT_FALSE(view.would_show({0.0, 0.0, -5.4}, 0.3));
  EXPECT_FALSE(view.would_show({0.0, 0.0, -8.9}, 0.3)) << "hidden behind the nearer one";
  EXPECT_TRUE(view.would_show({1.5, 0.5, 1.0}, 0.3));
}

TEST(ViewGrid, ShowsNothingWhereNobodyLooked) {
  const std::vector<CloudPoint> cloud = {point_at(0, 0, -5)};
  const ViewGrid view(cloud, kCell);
  EXPECT_FALSE(view.would_show({0.0, 0.0, 5.0}, 0.3));
  EXPECT_FALSE(view.would_show({0.0, 2.0, -4.0}, 0.3));
  EXPECT_FALSE(view.would_show({2.0, 0.0, -4.0}, 0.3));
}

TEST(ViewGrid, CoversEveryDirection) {
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.0, 3.0, 0.0), Eigen::Vector3d(0.0, -3.0, 0.0),
                                   Eigen::Vector3d(-1e-9, 0.0, -3.0), Eigen::Vector3d(0.0, 0.0, 0.0)}) {
    const std::vector<CloudPoint> cloud = {{p.cast<float>(), 0.0F}};
    EXPECT_TRUE(ViewGrid(cloud, kCell).would_show(p, 0.1));
  }
}

}  // namespace
}  // namespace ignis
