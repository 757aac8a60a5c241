// SPDX-License-Identifier: Apache-2.0
#include "frontend/degeneracy.h"

#include <gtest/gtest.h>

#include "frontend/simulated_planes.h"

namespace ignis {
namespace {

using test::Planes;

TEST(Degeneracy, WhatErrorsOfTheNormalsExplainIsNotAnObservation) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const Planes planes = test::corridor_planes(0.03, 0, seed);
    const DegeneracyAnalysis blind = analyse_degeneracy(planes.sensitivity, Matrix6d::Zero(), {4.0, 1e-5, 1.6});
    EXPECT_EQ(blind.degenerate_directions, 0) << "without the noise nothing looks wrong";
    const DegeneracyAnalysis aware = analyse_degeneracy(planes.sensitivity, planes.noise, {4.0, 1e-5, 1.6});
    ASSERT_EQ(aware.degenerate_directions, 1) << seed;
    EXPECT_GT(std::abs(aware.degenerate[0][5]), 0.99) << "along the corridor";
  }
}

TEST(Degeneracy, AFewRealFacesMakeTheAxisObserved) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const Planes planes = test::corridor_planes(0.03, 12, seed);
    EXPECT_EQ(analyse_degeneracy(planes.sensitivity, planes.noise, {4.0, 1e-5, 1.6}).degenerate_directions, 0) << seed;
  }
}

TEST(Degeneracy, AWeakDirectionLosesTheShareThatIsNoise) {
  Matrix6d sensitivity = Matrix6d::Identity() / 3.0;
  Matrix6d noise = Matrix6d::Zero();
  noise(5, 5) = 1.0 / 15.0;
  const DegeneracyAnalysis analysis = analyse_degeneracy(sensitivity, noise, {1.0, 1e-5, 1.6});
  EXPECT_EQ(analysis.degenerate_directions, 0);
  const Matrix6d kept = analysis.projector.transpose() * sensitivity * analysis.projector;
  EXPECT_NEAR(kept(5, 5), 1.0 / 3.0 - 1.0 / 15.0, 1e-12);
  EXPECT_NEAR(kept(4, 4), 1.0 / 3.0, 1e-12);
}

TEST(Degeneracy, ABlindDirectionIsCutOutOfTheReliablePartAndItsTrueShareIsDoubtful) {
  Matrix6d sensitivity = Matrix6d::Identity() / 3.0;
  sensitivity(5, 5) = 0.1;
  Matrix6d noise = Matrix6d::Zero();
  noise(5, 5) = 0.08;
  const DegeneracyAnalysis analysis = analyse_degeneracy(sensitivity, noise, {2.0, 1e-5, 1.6});
  ASSERT_EQ(analysis.degenerate_directions, 1);
  EXPECT_LT((analysis.projector * Vector6d::Unit(5)).norm(), 1e-12);
  const Matrix6d kept = analysis.doubtful.transpose() * sensitivity * analysis.doubtful;
  EXPECT_NEAR(kept(5, 5), 0.1 - 0.08, 1e-12);
  EXPECT_LT(kept.topLeftCorner(5, 5).norm(), 1e-12);
  EXPECT_LT((analysis.blind_part - Vector6d::Unit(5) * Vector6d::Unit(5).transpose()).norm(), 1e-12);
}

TEST(Degeneracy, ShiftsAreTheDegenerateDirectionsThatAreMostlyPosition) {
  DegeneracyAnalysis analysis;
  Vector6d turn_and_shift = Vector6d::Zero();
  turn_and_shift[2] = 0.6;
  turn_and_shift[3] = 0.8;
  analysis.degenerate = {Vector6d::Unit(1), turn_and_shift};
  const std::vector<Eigen::Vector3d> axes = blind_shifts(analysis);
  ASSERT_EQ(axes.size(), 1U);
  EXPECT_EQ(axes[0], Eigen::Vector3d::UnitX());
}

TEST(Degeneracy, AShiftThatIsKnownOtherwiseIsNotReported) {
  DegeneracyAnalysis analysis;
  analysis.degenerate = {Vector6d::Unit(1), Vector6d::Unit(3), Vector6d::Unit(5)};
  analysis.degenerate_directions = 3;
  const Eigen::Matrix3d information = Eigen::Vector3d(99.0, 0.0, 101.0).asDiagonal();
  const DegeneracyAnalysis open = without_known_shifts(analysis, information, 0.1);
  EXPECT_EQ(open.degenerate_directions, 2);
  EXPECT_EQ(describe(open), "turn about body (0.00, 1.00, 0.00); position along odom (1.00, 0.00, 0.00)");
}

TEST(Degeneracy, NamesADirectionByItsLargerPartAndWithoutASign) {
  DegeneracyAnalysis analysis;
  EXPECT_EQ(describe(analysis), "");
  analysis.degenerate = {-Vector6d::Unit(5), Vector6d::Unit(1)};
  EXPECT_EQ(describe(analysis), "position along odom (0.00, 0.00, 1.00); turn about body (0.00, 1.00, 0.00)");
}

}  // namespace
}  // namespace ignis
