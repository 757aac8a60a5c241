// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/scan_trust.h"

#include <gtest/gtest.h>

#include <cmath>

#include "backend/keyframes/odometry_chain.h"
#include "common/so3.h"

namespace ignis {
namespace {

Matrix6d information_of(double sigma_rad, double sigma_m) {
  Vector6d sigmas;
  sigmas << Eigen::Vector3d::Constant(sigma_rad), Eigen::Vector3d::Constant(sigma_m);
  return sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
}

Matrix6d corridor(double sigma_along) {
  Matrix6d information = information_of(2e-4, 1e-3);
  information(5, 5) = 1.0 / (sigma_along * sigma_along);
  return information;
}

TEST(ScanTrust, LeavesWhatIsKnownAlikeWhateverTheSensor) {
  for (const double sigma_rad : {1e-4, 1e-2}) {
    for (const double sigma_m : {1e-3, 0.1}) {
      const Matrix6d known = information_of(sigma_rad, sigma_m);
      EXPECT_LT((trusted_information(known) - known).norm(), 1e-9 * known.norm());
    }
  }
}

TEST(ScanTrust, CountsWhatScansHardlyObserveForLittle) {
  const auto share_along = [](double sigma) {
    return trusted_information(corridor(sigma))(5, 5) / corridor(sigma)(5, 5);
  };
  EXPECT_NEAR(share_along(0.2), 0.126, 0.001);
  EXPECT_NEAR(share_along(1e-3 / std::sqrt(0.3)), 0.694, 0.01);
  EXPECT_NEAR(share_along(0.0011), 1.0, 0.05);
  EXPECT_NEAR(trusted_information(corridor(0.2))(4, 4) / corridor(0.2)(4, 4), 1.0, 1e-9);
}

TEST(ScanTrust, ComparesAttitudeWithAttitude) {
  Matrix6d yard = information_of(2e-4, 1e-3);
  yard(1, 1) = 1.0 / (0.05 * 0.05);
  EXPECT_NEAR(trusted_information(yard)(1, 1) / yard(1, 1), 0.126, 0.001);
  EXPECT_NEAR(trusted_information(yard)(0, 0) / yard(0, 0), 1.0, 1e-9);
  EXPECT_NEAR(trusted_information(yard)(3, 3) / yard(3, 3), 1.0, 1e-9);
}

TEST(ScanTrust, TurnsWithTheBody) {
  const Matrix6d turn = adjoint({so3::exp({0.3, -0.8, 0.5}), Eigen::Vector3d::Zero()});
  const Matrix6d turned = turn * trusted_information(corridor(0.05)) * turn.transpose();
  EXPECT_LT((trusted_information(turn * corridor(0.05) * turn.transpose()) - turned).norm(), 1e-9 * turned.norm());
}

TEST(ScanTrust, NeitherInventsNorKeepsWhatIsNegative) {
  EXPECT_EQ(trusted_information(Matrix6d::Zero()).norm(), 0.0);
  Matrix6d leftover = information_of(1e-4, 5e-4);
  leftover(5, 5) = -3.0;
  EXPECT_NEAR(trusted_information(leftover)(5, 5), 0.0, 1e-9);
}

}  // namespace
}  // namespace ignis
