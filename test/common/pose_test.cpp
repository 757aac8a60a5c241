// SPDX-License-Identifier: Apache-2.0
#include "common/pose.h"

#include <limits>

#include <gtest/gtest.h>

#include "common/so3.h"

namespace ignis {
namespace {

const Pose kA{so3::exp({0.3, -0.4, 0.5}), {1.0, -2.0, 3.0}};
const Pose kB{so3::exp({-1.1, 0.2, 0.7}), {0.4, 5.0, -0.6}};

TEST(Pose, ProductActsLikeBothTransformsInTurn) {
  const Eigen::Vector3d point(0.7, 0.1, -2.0);
  EXPECT_LT((kA * kB * point - kA * (kB * point)).norm(), 1e-12);
}

TEST(Pose, InverseUndoesTheTransform) {
  const Eigen::Vector3d point(0.7, 0.1, -2.0);
  EXPECT_LT((kA.inverse() * (kA * point) - point).norm(), 1e-12);
}

TEST(Pose, BodyDifferenceInvertsBodyPerturbation) {
  Vector6d delta;
  delta << 0.1, -0.2, 0.05, 1.0, 2.0, -3.0;
  EXPECT_LT((body_difference(kA, perturbed_in_body(kA, delta)) - delta).norm(), 1e-12);
}

TEST(Pose, PerturbationMovesAlongBodyAxes) {
  Vector6d forward = Vector6d::Zero();
  forward[5] = -1.0;
  const Pose moved = perturbed_in_body(kA, forward);
  EXPECT_LT((moved.translation - (kA.translation + kA.rotation * Eigen::Vector3d(0, 0, -1))).norm(), 1e-12);
}

TEST(Pose, InterpolationMeetsBothEndsAndHalvesTheTurn) {
  EXPECT_LT(body_difference(kA, interpolate(kA, kB, 0.0)).norm(), 1e-9);
  EXPECT_LT(body_difference(kB, interpolate(kA, kB, 1.0)).norm(), 1e-9);
  const Pose half = interpolate(kA, kB, 0.5);
  EXPECT_NEAR(half.rotation.angularDistance(kA.rotation), half.rotation.angularDistance(kB.rotation), 1e-12);
}

TEST(Pose, AllFiniteSeesNanInEitherHalf) {
  Pose pose = kA;
  EXPECT_TRUE(pose.all_finite());
  pose.translation.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(pose.all_finite());
  pose = kA;
  pose.rotation.z() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(pose.all_finite());
}

}  // namespace
}  // namespace ignis
