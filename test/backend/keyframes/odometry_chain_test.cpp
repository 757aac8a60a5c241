// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframes/odometry_chain.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>
#include <vector>

#include "common/so3.h"

namespace ignis {
namespace {

Vector6d random_vector(std::mt19937& random, double rotation, double position) {
  std::normal_distribution<double> unit;
  Vector6d v;
  for (int i = 0; i < 6; ++i) v(i) = unit(random) * (i < 3 ? rotation : position);
  return v;
}

Matrix6d random_covariance(std::mt19937& random) {
  Matrix6d root;
  for (int i = 0; i < 6; ++i) root.col(i) = random_vector(random, 0.002, 0.01);
  return root * root.transpose() + 1e-8 * Matrix6d::Identity();
}

struct Walk {
  explicit Walk(unsigned seed, int count) {
    std::mt19937 random(seed);
    Pose pose = perturbed_in_body(Pose(), random_vector(random, 0.5, 10.0));
    for (int i = 0; i < count; ++i) {
      steps.push_back(perturbed_in_body(Pose(), random_vector(random, 0.2, 1.0)));
      noise.push_back(random_covariance(random));
      pose = pose * steps.back();
      poses.push_back(pose);
      chain.append(pose, noise.back(), Matrix6d::Zero());
    }
  }
  std::vector<Pose> steps;
  std::vector<Pose> poses;
  std::vector<Matrix6d> noise;
  OdometryChain chain;
};

TEST(OdometryChain, SumsTheStepsBetweenAnyTwoKeyframes) {
  const Walk walk(3, 40);
  for (const auto& [from, to] : {std::pair<std::size_t, std::size_t>{0, 39}, {7, 8}, {12, 30}}) {
    Matrix6d expected = Matrix6d::Zero();
    for (std::size_t i = from + 1; i <= to; ++i) {
      const Matrix6d back = adjoint(walk.steps[i].inverse());
      expected = back * expected * back.transpose() + walk.noise[i];
    }
    EXPECT_LT((walk.chain.covariance(from, to) - expected).norm(), 1e-9 * expected.norm());
    EXPECT_LT(body_difference(walk.chain.T_from_to(from, to), walk.poses[from].inverse() * walk.poses[to]).norm(),
              1e-12);
  }
  EXPECT_EQ(walk.chain.covariance(5, 5).norm(), 0.0);
}

TEST(OdometryChain, TellsTheSameFromBothEnds) {
  const Walk walk(4, 20);
  const Matrix6d there = adjoint(walk.chain.T_from_to(3, 17));
  const Matrix6d expected = there * walk.chain.covariance(3, 17) * there.transpose();
  EXPECT_LT((walk.chain.covariance(17, 3) - expected).norm(), 1e-9 * expected.norm());
}

TEST(OdometryChain, IsTheSpreadOfManyDrives) {
  const Walk walk(5, 12);
  std::mt19937 random(6);
  Matrix6d spread = Matrix6d::Zero();
  constexpr int kDrives = 4000;
  std::vector<Eigen::LLT<Matrix6d>> roots;
  for (const Matrix6d& noise : walk.noise) roots.emplace_back(noise);
  for (int drive = 0; drive < kDrives; ++drive) {
    Pose T_from_to;
    for (std::size_t i = 3; i < 12; ++i) {
      const Vector6d error = roots[i].matrixL() * random_vector(random, 1.0, 1.0);
      T_from_to = T_from_to * perturbed_in_body(walk.steps[i], error);
    }
    const Vector6d error = body_difference(walk.chain.T_from_to(2, 11), T_from_to);
    spread += error * error.transpose() / kDrives;
  }
  const Matrix6d predicted = walk.chain.covariance(2, 11);
  EXPECT_LT((spread - predicted).norm(), 0.08 * predicted.norm());
}

double smallest_eigenvalue(const Matrix6d& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(symmetric, Eigen::EigenvaluesOnly).eigenvalues()(0);
}

TEST(OdometryChain, TheLargerOfTwoCovariancesCoversBoth) {
  std::mt19937 random(8);
  for (int i = 0; i < 50; ++i) {
    const Matrix6d a = random_covariance(random);
    const Matrix6d b = random_covariance(random);
    const Matrix6d larger = larger_of(a, b);
    EXPECT_GT(smallest_eigenvalue(larger - a), -1e-12);
    EXPECT_GT(smallest_eigenvalue(larger - b), -1e-12);
    EXPECT_LT((larger - larger_of(b, a)).norm(), 1e-9 * larger.norm());
    EXPECT_EQ(larger_of(a, 0.5 * a), a);
    EXPECT_EQ(larger_of(a, -b), a);
  }
}

TEST(OdometryChain, NoStepIsSurerThanTheFiltersCovarianceHasGrown) {
  // Dead reckoning along x with a velocity that is off by 0.1 m/s: each step says 1 cm, together they are 2 m off.
  OdometryChain chain;
  Matrix6d step = 1e-4 * Matrix6d::Identity();
  step.topLeftCorner<3, 3>() *= 1e-9;
  for (int i = 0; i <= 20; ++i) {
    Matrix6d filter = Matrix6d::Zero();
    filter(3, 3) = 0.01 * i * i;
    chain.append({Eigen::Quaterniond::Identity(), {0.0, 0.0, -1.0 * i}}, step, filter);
  }
  const Matrix6d covariance = chain.covariance(0, 20);
  EXPECT_NEAR(covariance(3, 3), 4.0, 1e-6);
  EXPECT_NEAR(covariance(5, 5), 20e-4, 1e-6);
}

TEST(OdometryChain, AnErrorThatTurnsTheWholeDriveIsNoGrowth) {
  // The start's heading is off by 0.1 rad, and with it every place by so much times its distance.
  Matrix6d start = Matrix6d::Zero();
  start(1, 1) = 0.01;
  OdometryChain chain;
  const Matrix6d step = 1e-6 * Matrix6d::Identity();
  for (int i = 0; i <= 20; ++i) {
    const Pose T_odom_body{Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d::UnitY())),
                           {0.0, 0.0, -5.0 * i}};
    const Matrix6d to_body = adjoint(T_odom_body.inverse());
    chain.append(T_odom_body, step, to_body * start * to_body.transpose());
  }
  EXPECT_NEAR(chain.covariance(19, 20)(3, 3), 1e-6, 1e-9);
}

TEST(OdometryChain, KnowsLittleWhereTheRowsAreSilent) {
  WhiteningRows rows = WhiteningRows::Zero(5, 6);
  for (int i = 0; i < 5; ++i) rows(i, i) = 100.0;
  const Matrix6d covariance = covariance_of(rows, Matrix6d::Identity() * 4.0);
  EXPECT_NEAR(covariance(0, 0), 1e-4, 1e-7);
  EXPECT_NEAR(covariance(5, 5), 0.25, 1e-12);
}

}  // namespace
}  // namespace ignis
