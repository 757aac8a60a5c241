// SPDX-License-Identifier: Apache-2.0
#include "drivers/body_mount.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "common/so3.h"

namespace ignis::l1 {
namespace {

constexpr double kHalf = 0.70710678118654752;

Eigen::Vector3d body_of(const BodyMount& mount, const Eigen::Vector3d& p_sensor) {
  const auto points = mount.to_body({{p_sensor, 1.0F, 0}});
  return points.at(0).position.cast<double>();
}

TEST(BodyMount, TurnsALevelSensorIntoVehicleAxes) {
  const BodyMount mount(Extrinsics{}, {});
  EXPECT_TRUE(body_of(mount, {1, 0, 0}).isApprox(Eigen::Vector3d(0, 0, -1)));  // forward
  EXPECT_TRUE(body_of(mount, {0, 1, 0}).isApprox(Eigen::Vector3d(-1, 0, 0)));  // left
  EXPECT_TRUE(body_of(mount, {0, 0, 1}).isApprox(Eigen::Vector3d(0, 1, 0)));   // up
}

TEST(BodyMount, PutsTheL1sHemisphereForwardsAndDown) {
  const BodyMount mount(l1_extrinsics(), {});
  // The zenith of a sensor tilted 45 degrees forward looks forward and up; its own forward looks at the ground ahead.
  EXPECT_TRUE(body_of(mount, {0, 0, 1}).isApprox(Eigen::Vector3d(0, kHalf, -kHalf), 1e-6));
  EXPECT_TRUE(body_of(mount, {1, 0, 0}).isApprox(Eigen::Vector3d(0, -kHalf, -kHalf), 1e-6));
}

TEST(BodyMount, ReadsGravityUpwardsWhateverTheTilt) {
  const BodyMount mount(l1_extrinsics(), {});
  const Eigen::Quaterniond q_body_imu = l1_extrinsics().imu.T_body_sensor().rotation;
  const Eigen::Vector3d accel_imu = q_body_imu.conjugate() * Eigen::Vector3d(0, 9.81, 0);
  EXPECT_TRUE(mount.to_body(Eigen::Vector3d::Zero(), accel_imu).accel.isApprox(Eigen::Vector3d(0, 9.81, 0), 1e-9));
}

TEST(BodyMount, PutsTheInertialUnitWhereTheDataSheetSays) {
  const Extrinsics extrinsics = l1_extrinsics();
  const Pose T_lidar_imu = extrinsics.lidar.T_body_sensor().inverse() * extrinsics.imu.T_body_sensor();
  EXPECT_TRUE(T_lidar_imu.translation.isApprox(Eigen::Vector3d(-0.007698, -0.014655, 0.00667), 1e-9));
  EXPECT_NEAR(T_lidar_imu.rotation.angularDistance(Eigen::Quaterniond::Identity()), 0.0, 1e-9);
}

TEST(BodyMount, MovesTheForceOfASteadyTurnToTheBodyOrigin) {
  // Oracle: second difference of the true path of the unit, r_world(t) = exp(w t) r, in body axes at t = 0.
  Extrinsics extrinsics = l1_extrinsics();
  extrinsics.imu.translation_m = {0.3, -0.2, 0.5};
  const BodyMount mount(extrinsics, {});
  const Pose T_body_imu = extrinsics.imu.T_body_sensor();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-3.0, 3.0);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d w(uniform(random), uniform(random), uniform(random));
    const double h = 1e-4;
    const Eigen::Vector3d r = T_body_imu.translation;
    const Eigen::Vector3d acceleration = (so3::exp(w * h) * r - 2.0 * r + so3::exp(-w * h) * r) / (h * h);
    const Eigen::Vector3d f_origin(0.0, 9.81, 0.0);
    const Eigen::Vector3d f_imu = T_body_imu.rotation.conjugate() * (f_origin + acceleration);
    const ImuSample sample = mount.to_body(T_body_imu.rotation.conjugate() * w, f_imu);
    EXPECT_LT((sample.accel - f_origin).norm(), 1e-4);
    EXPECT_LT((sample.gyro - w).norm(), 1e-9);
  }
}

TEST(BodyMount, DropsPointsOnTheVehicle) {
  const OwnStructureBox box{{-0.1, -0.1, -1.1}, {0.1, 0.1, -0.9}};
  const BodyMount mount(Extrinsics{}, {box});
  const auto points =
      mount.to_body({{{1.0, 0.0, 0.0}, 1.0F, 0}, {{1.2, 0.0, 0.0}, 2.0F, 1}, {{1.0, 0.2, 0.0}, 3.0F, 2}});
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points[0].index, 1);
  EXPECT_EQ(points[1].index, 2);
  EXPECT_EQ(points[1].intensity, 3.0F);
}

}  // namespace
}  // namespace ignis::l1
