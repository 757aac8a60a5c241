// SPDX-License-Identifier: Apache-2.0
#include "common/compact_cloud.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace ignis {
namespace {

std::vector<CloudPoint> random_cloud(double reach_m, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-static_cast<float>(reach_m), static_cast<float>(reach_m));
  std::vector<CloudPoint> cloud;
  for (int i = 0; i < 500; ++i) cloud.push_back({{place(random), place(random), place(random)}, 7.0F});
  return cloud;
}

TEST(CompactCloud, KeepsEachCoordinateWithinHalfItsResolutionInSixBytesAPoint) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const std::vector<CloudPoint> cloud = random_cloud(3.0 * seed, seed);
    const CompactCloud small = compact(cloud);
    EXPECT_EQ(small.bytes(), 6 * cloud.size());
    EXPECT_LE(small.resolution_m, 3 * seed <= 32 ? 0.001F : 0.002F);
    const std::vector<CloudPoint> back = expanded(small);
    ASSERT_EQ(back.size(), cloud.size());
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const float error = (back[i].position - cloud[i].position).cwiseAbs().maxCoeff();
      EXPECT_LE(error, 0.5F * small.resolution_m + 1e-5F);
    }
  }
}

TEST(CompactCloud, IsTheSameWhenItIsMadeOfItselfAgain) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const CompactCloud once = compact(random_cloud(8.0 * seed, seed));
    const CompactCloud twice = compact(expanded(once));
    EXPECT_EQ(twice.resolution_m, once.resolution_m);
    EXPECT_EQ(twice.counts, once.counts);
  }
}

TEST(CompactCloud, HoldsTheFarthestPointThatItsBitsReach) {
  for (const float reach : {0.0F, 32.767F, 32.768F, 65.5F, 1e3F, 1e9F}) {
    const std::vector<CloudPoint> cloud{{{reach, -reach, 0.5F * reach}, 0.0F}};
    const CompactCloud small = compact(cloud);
    const Eigen::Vector3f error = expanded(small).front().position - cloud.front().position;
    EXPECT_LE(error.cwiseAbs().maxCoeff(), 0.51F * small.resolution_m) << reach;
  }
}

TEST(CompactCloud, LeavesOutWhatIsNotFinite) {
  std::vector<CloudPoint> cloud = random_cloud(5.0, 1);
  cloud[3].position.x() = std::numeric_limits<float>::infinity();
  cloud[7].position.y() = std::numeric_limits<float>::quiet_NaN();
  const CompactCloud small = compact(cloud);
  EXPECT_EQ(small.size(), cloud.size() - 2);
  EXPECT_FLOAT_EQ(small.resolution_m, 0.001F);
}

}  // namespace
}  // namespace ignis
