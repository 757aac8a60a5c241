// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/degeneracy.h"

#include <gtest/gtest.h>

#include <cmath>

#include <Eigen/Eigenvalues>

#include "frontend/simulated_planes.h"

namespace ignis {
namespace {

using test::Planes;

constexpr double kLength = 3.0;  // m

struct Judged {
  Matrix6d basis;
  std::array<bool, 6> blind{};
  std::array<bool, 6> turning{};
};

Judged judged(const Planes& planes, const Matrix6d& basis) {
  const ScaledSensitivity scan(planes.sensitivity, planes.noise, kLength);
  std::array<double, 6> needed;
  needed.fill(2.0);
  const std::array<bool, 6> blind = blind_among(basis, scan, needed, {.min_sensitivity = 1e-5});
  return {basis, blind, turning_among(basis, blind, scan)};
}

Judged judged(const Planes& planes) {
  const ScaledSensitivity scan(planes.sensitivity, planes.noise, kLength);
  return judged(planes, Eigen::SelfAdjointEigenSolver<Matrix6d>(scan.value).eigenvectors());
}

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

TEST(Degeneracy, AShiftIsBelievedToBeOneUntilItRunsIntoTheWalls) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const Judged straight = judged(test::corridor_planes(0.03, 0, seed));
    ASSERT_TRUE(straight.blind[0]) << seed;
    EXPECT_FALSE(straight.turning[0]) << seed;
    for (const double radius : {6.0, 12.0, 25.0}) {
      const Judged bend = judged(test::bend_planes(radius, 0.03, seed));
      ASSERT_TRUE(bend.blind[0]) << seed;
      ASSERT_GT(bend.basis.col(0).tail<3>().norm(), 0.8) << "mostly a shift";
      EXPECT_TRUE(bend.turning[0]) << seed << ", " << radius << " m";
    }
  }
}

TEST(Degeneracy, AShiftIsOneWhereATurnIsAsBlind) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    // The ground alone: two shifts and a turn are blind, and how a basis mixes them is chance.
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> where(-2.5, 2.5);
    Planes planes;
    for (int i = 0; i < 800; ++i) {
      const Eigen::Vector3d point(where(random), -0.6, where(random));
      test::add_point(planes, point, Eigen::Vector3d::UnitY(), 0.03, 800, random);
    }
    Matrix6d basis = Matrix6d::Identity();
    basis(1, 1) = basis(5, 5) = std::cos(0.6);
    basis(5, 1) = std::sin(0.6);
    basis(1, 5) = -std::sin(0.6);
    const Judged ground = judged(planes, basis);
    ASSERT_TRUE(ground.blind[1] && ground.blind[3] && ground.blind[5]) << seed;
    EXPECT_EQ(ground.turning, (std::array<bool, 6>{})) << seed;
  }
}

TEST(Degeneracy, ATurningDirectionKeepsItsTurn) {
  const Planes planes = test::bend_planes(6.0, 0.03, 1);
  const Judged bend = judged(planes);
  const ScaledSensitivity scan(planes.sensitivity, planes.noise, kLength);
  const Vector6d turning = without_blind(bend.basis, scan, bend.blind, bend.turning, 1e-5).degenerate.at(0);
  EXPECT_GT(std::abs(turning.dot(bend.basis.col(0))), 1.0 - 1e-9);
  const Vector6d shift = without_blind(bend.basis, scan, bend.blind, {}, 1e-5).degenerate.at(0);
  EXPECT_EQ(shift.head<3>(), Eigen::Vector3d::Zero());
}

TEST(Degeneracy, AlongABendAPointGoesWhereItsOwnWallGoes) {
  constexpr double kRadius = 6.0;  // about an upright axis to the left
  DegeneracyAnalysis analysis;
  analysis.length_m = kLength;
  const Eigen::Matrix3d R = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()).toRotationMatrix();
  Vector6d motion;
  motion << kLength / kRadius * (R.transpose() * Eigen::Vector3d::UnitY()), -Eigen::Vector3d::UnitZ();
  analysis.degenerate = {motion.normalized(), Vector6d::Unit(1)};
  const Eigen::AngleAxisd round(0.7, Eigen::Vector3d::UnitY());
  const Eigen::Vector3d axis(-kRadius, 0.0, 0.0);
  const Eigen::Vector3d point = axis + round * Eigen::Vector3d(kRadius + 1.4, 0.0, 0.0);
  std::vector<Eigen::Vector3d> axes;
  blind_shifts_of_point(analysis, R, R.transpose() * point, axes);
  ASSERT_EQ(axes.size(), 1U) << "a turn alone is no shift";
  EXPECT_NEAR(axes[0].dot(round * -Eigen::Vector3d::UnitZ()), 1.0, 1e-9);
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

TEST(Degeneracy, NamesTheTurnThatGoesWithAShift) {
  DegeneracyAnalysis analysis;
  analysis.length_m = 4.0;
  // Along a circle of 8 m radius: backwards by 0.8 m is a turn by -0.1 rad.
  analysis.degenerate = {Vector6d::Unit(5) * -0.8 + Vector6d::Unit(1) * -0.1 * analysis.length_m};
  EXPECT_EQ(describe(analysis),
            "position along odom (0.00, 0.00, 1.00), turning 0.125 rad/m about body (0.00, 1.00, 0.00)");
}

/// Sixty drives of a bare corridor: 27 m off along it, 0.08 m across, heading included.
TEST(Degeneracy, AShiftThatNothingHoldsMakesThreeMillimetresAMetreAcrossIt) {
  DegeneracyAnalysis analysis;
  analysis.degenerate = {Vector6d::Unit(5)};
  const Eigen::Vector3d sigmas(0.02, 0.03, 27.0);
  const Eigen::Matrix3d tilt = tilt_of_blind_shifts(analysis, sigmas.cwiseAbs2().asDiagonal());
  EXPECT_NEAR(std::sqrt(tilt(0, 0)), 0.08, 0.01);
  EXPECT_NEAR(std::sqrt(tilt(1, 1)), 0.08, 0.01);
  EXPECT_EQ(tilt(2, 2), 0.0);
}

}  // namespace
}  // namespace ignis
