// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/scan_update.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "common/so3.h"
#include "frontend/matching/degeneracy.h"

namespace ignis {
namespace {

struct ScalarConstraint {
  Vector6d h;
  double z;
  double variance;
};

/// The reference's update: one point at a time with a scalar Kalman gain, all linearised at the prior.
UpdateStep update_points(const ErrorCovariance& prior, const std::vector<ScalarConstraint>& constraints) {
  UpdateStep result;
  result.covariance = prior;
  for (const ScalarConstraint& constraint : constraints) {
    ErrorVector H = ErrorVector::Zero();
    H.head<6>() = constraint.h;
    const ErrorVector PH = result.covariance * H;
    const double S = H.dot(PH) + constraint.variance;
    const ErrorVector K = PH / S;
    result.step -= K * (constraint.z + H.dot(result.step));
    result.covariance = (ErrorCovariance::Identity() - K * H.transpose()) * result.covariance;
  }
  return result;
}

ErrorCovariance random_covariance(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const ErrorCovariance A = ErrorCovariance::NullaryExpr([&] { return 0.05 * normal(random); });
  return A * A.transpose() + 1e-6 * ErrorCovariance::Identity();
}

std::vector<ScalarConstraint> random_constraints(std::mt19937& random, int count) {
  std::normal_distribution<double> normal;
  std::vector<ScalarConstraint> constraints;
  for (int i = 0; i < count; ++i) {
    const Vector6d h = Vector6d::NullaryExpr([&] { return normal(random); });
    constraints.push_back({h, 0.02 * normal(random), 0.01 * (1.0 + i % 3)});
  }
  return constraints;
}

PoseInformation summed(const std::vector<ScalarConstraint>& constraints) {
  PoseInformation sum;
  for (const ScalarConstraint& constraint : constraints) sum.add(constraint.h, constraint.z, constraint.variance);
  return sum;
}

TEST(ScanUpdate, InformationFormEqualsScalarUpdates) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const ErrorCovariance prior = random_covariance(random);
    const std::vector<ScalarConstraint> constraints = random_constraints(random, 1 + 20 * trial);
    const UpdateStep scalar = update_points(prior, constraints);
    const UpdateStep information = information_update(prior, ErrorVector::Zero(), summed(constraints));
    ASSERT_TRUE(information.ok);
    EXPECT_LT((scalar.step - information.step).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((scalar.covariance - information.covariance).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(ScanUpdate, LaterPassIsTheMinimumOfPriorPlusConstraints) {
  // Normal equations with an explicit inverse of the prior, at an iterate away from it.
  std::mt19937 random(2);
  const ErrorCovariance prior = random_covariance(random);
  const PoseInformation sum = summed(random_constraints(random, 50));
  ErrorVector deviation = ErrorVector::LinSpaced(-0.05, 0.08);
  const UpdateStep update = information_update(prior, deviation, sum);

  ErrorCovariance J = ErrorCovariance::Identity();
  J.block<3, 3>(kAttitude, kAttitude) = so3::right_jacobian_inverse(deviation.segment<3>(kAttitude));
  ErrorCovariance normal = J.transpose() * prior.inverse() * J;
  ErrorVector gradient = J.transpose() * prior.inverse() * deviation;
  normal.topLeftCorner<6, 6>() += sum.information;
  gradient.head<6>() += sum.gradient;
  EXPECT_LT((update.step + normal.inverse() * gradient).norm(), 1e-8);
  EXPECT_LT((update.covariance - normal.inverse()).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(ScanUpdate, WithoutConstraintsReturnsToThePrior) {
  std::mt19937 random(3);
  const ErrorCovariance prior = random_covariance(random);
  const UpdateStep update = information_update(prior, ErrorVector::Zero(), {});
  EXPECT_EQ(update.step.norm(), 0.0);
  EXPECT_LT((update.covariance - prior).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(ScanUpdate, ReportsValuesThatAreNotFinite) {
  PoseInformation sum;
  sum.add(Vector6d::Constant(std::nan("")), 0.0, 0.01);
  EXPECT_FALSE(information_update(ErrorCovariance::Identity(), ErrorVector::Zero(), sum).ok);
}

TEST(NormalisedInnovation, OfOneConstraintIsTheScalarOne) {
  std::mt19937 random(5);
  const Matrix6d P = random_covariance(random).topLeftCorner<6, 6>();
  const ScalarConstraint constraint = random_constraints(random, 1).front();
  PoseInformation sum;
  sum.add(constraint.h, 0.07, constraint.variance);
  const Innovation innovation = normalised_innovation(P, sum);
  EXPECT_EQ(innovation.directions, 1);
  EXPECT_NEAR(innovation.squared, 0.07 * 0.07 / (constraint.h.dot(P * constraint.h) + constraint.variance), 1e-9);
}

TEST(NormalisedInnovation, HasTheMeanOfItsDegreesOfFreedomWhenCovariancesAreTrue) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  const Matrix6d P = random_covariance(random).topLeftCorner<6, 6>();
  const Matrix6d root = P.llt().matrixL();
  const std::vector<ScalarConstraint> constraints = random_constraints(random, 60);
  constexpr int kTrials = 4000;
  double sum = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Vector6d white;
    for (double& value : white) value = normal(random);
    const Vector6d error = root * white;
    PoseInformation measured;
    for (const ScalarConstraint& c : constraints) {
      measured.add(c.h, c.h.dot(error) + std::sqrt(c.variance) * normal(random), c.variance);
    }
    const Innovation innovation = normalised_innovation(P, measured);
    ASSERT_EQ(innovation.directions, 6);
    sum += innovation.squared / kTrials;
  }
  EXPECT_NEAR(sum, 6.0, 4.0 * std::sqrt(12.0 / kTrials))
      << "chi-square of 6 degrees of freedom, four sigma of its mean";
}

TEST(Degeneracy, FindsTheDirectionThatNoPlaneSees) {
  // Planes facing X and Y only, at various lever arms: position along Z is free.
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-5.0, 5.0);
  Matrix6d sensitivity = Matrix6d::Zero();
  constexpr int kPoints = 400;
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector3d normal = i % 2 == 0 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    const double x = uniform(random);
    const double y = uniform(random);
    const double z = uniform(random);
    Vector6d h;
    h << Eigen::Vector3d(x, y, z).cross(normal), normal;
    sensitivity += h * h.transpose() / kPoints;
  }
  const DegeneracyAnalysis analysis = analyse_degeneracy(sensitivity, Matrix6d::Zero(), {4.0, 0.004, 1.6});
  EXPECT_EQ(analysis.degenerate_directions, 1);
  Vector6d along_z = Vector6d::Zero();
  along_z[5] = 1.0;
  EXPECT_LT((analysis.projector * along_z).norm(), 1e-9);
  const Vector6d along_x = Vector6d::Unit(3);
  EXPECT_LT((analysis.projector * along_x - along_x).norm(), 1e-6);
}

TEST(Degeneracy, ProjectedInformationLeavesThePriorAloneThere) {
  PoseInformation sum;
  for (int i = 0; i < 6; ++i) sum.add(Vector6d::Unit(i), 0.1, 0.01);
  Matrix6d projector = Matrix6d::Identity();
  projector(4, 4) = 0.0;
  const ErrorCovariance prior = 0.04 * ErrorCovariance::Identity();
  const UpdateStep update = information_update(prior, ErrorVector::Zero(), sum.projected(projector));
  EXPECT_DOUBLE_EQ(update.step[4], 0.0);
  EXPECT_DOUBLE_EQ(update.covariance(4, 4), 0.04);
  EXPECT_NEAR(update.step[3], -0.08, 1e-12);
}

TEST(ScanUpdate, ConsideredPartKeepsItsPlaceAndTheCovarianceIsThatOfTheGainWithoutIt) {
  std::mt19937 random(6);
  const ErrorCovariance P = random_covariance(random);
  const std::vector<ScalarConstraint> constraints = random_constraints(random, 30);
  ErrorCovariance considered = ErrorCovariance::Zero();
  const Eigen::Vector3d along = Eigen::Vector3d(0.3, -0.2, 0.9).normalized();
  considered.block<3, 3>(kPosition, kPosition) = along * along.transpose();
  considered.block<3, 3>(kVelocity, kVelocity) = along * along.transpose();
  const UpdateStep update = information_update(P, ErrorVector::Zero(), summed(constraints), considered);

  // All constraints at once with an explicit gain, and Joseph's form, which holds for any gain.
  const auto count = static_cast<Eigen::Index>(constraints.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(count, kErrorSize);
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd z(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const ScalarConstraint& constraint = constraints[static_cast<std::size_t>(i)];
    H.block<1, 6>(i, 0) = constraint.h.transpose();
    R(i, i) = constraint.variance;
    z[i] = constraint.z;
  }
  const Eigen::MatrixXd gain =
      (ErrorCovariance::Identity() - considered) * P * H.transpose() * (H * P * H.transpose() + R).inverse();
  const ErrorCovariance kept = ErrorCovariance::Identity() - gain * H;
  const ErrorCovariance expected = kept * P * kept.transpose() + gain * R * gain.transpose();
  ASSERT_TRUE(update.ok);
  EXPECT_LT((update.covariance - expected).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((update.step + gain * z).norm(), 1e-9);
  EXPECT_LT(std::abs(along.dot(update.step.segment<3>(kPosition))), 1e-12);
}

}  // namespace
}  // namespace ignis
