// SPDX-License-Identifier: Apache-2.0
#include "drivers/mount_estimate.h"

#include <random>

#include <gtest/gtest.h>

#include "common/frames.h"

namespace ignis::l1 {
namespace {

Mount mount_of(double yaw, double pitch, double roll) {
  Mount mount;
  mount.yaw_deg = yaw;
  mount.pitch_deg = pitch;
  mount.roll_deg = roll;
  return mount;
}

/// Where up is for a sensor that is mounted so, on level ground.
Eigen::Vector3d up_in_sensor(const Mount& mount) { return mount.T_body_sensor().rotation.conjugate() * frames::up(); }

TEST(Tilt, IsFoundBackFromGravityWhateverTheYaw) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> pitch(-85.0, 85.0);
  std::uniform_real_distribution<double> angle(-170.0, 170.0);
  for (int i = 0; i < 200; ++i) {
    const Mount truth = mount_of(angle(random), pitch(random), angle(random));
    const Tilt found = tilt_from_up(up_in_sensor(truth), Mount{});
    EXPECT_NEAR(found.pitch_deg, truth.pitch_deg, 1e-9);
    EXPECT_NEAR(found.roll_deg, truth.roll_deg, 1e-9);
  }
}

std::vector<Eigen::Vector3d> room_seen_from(const Mount& mount, double height, std::mt19937& random) {
  std::uniform_real_distribution<double> side(-4.0, 4.0);
  std::uniform_real_distribution<double> vertical(-height, 2.5);
  std::normal_distribution<double> noise(0.0, 0.01);
  std::vector<Eigen::Vector3d> points;
  const Eigen::Quaterniond q_sensor_body = mount.T_body_sensor().rotation.conjugate();
  for (int i = 0; i < 1500; ++i)
    points.push_back(q_sensor_body * Eigen::Vector3d(side(random), -height + noise(random), side(random)));
  for (int i = 0; i < 3000; ++i)
    points.push_back(q_sensor_body * Eigen::Vector3d(side(random), 2.5 + noise(random), side(random)));
  for (int i = 0; i < 2000; ++i)
    points.push_back(q_sensor_body * Eigen::Vector3d(4.0 + noise(random), vertical(random), side(random)));
  return points;
}

TEST(Floor, IsFoundBelowALargerCeiling) {
  std::mt19937 random(4);
  const Mount mount = mount_of(0.0, -43.0, 2.0);
  const auto floor = find_floor(room_seen_from(mount, 0.6, random), up_in_sensor(mount_of(0.0, -45.0, 0.0)));
  ASSERT_TRUE(floor);
  EXPECT_NEAR(floor->height_m, 0.6, 0.005);
  EXPECT_NEAR(floor->roughness_m, 0.01, 0.004);
  const Tilt tilt = tilt_from_up(floor->up_sensor, Mount{});
  EXPECT_NEAR(tilt.pitch_deg, -43.0, 0.1);
  EXPECT_NEAR(tilt.roll_deg, 2.0, 0.1);
}

TEST(Floor, IsNotInventedFromACeilingOrFewPoints) {
  std::mt19937 random(5);
  std::vector<Eigen::Vector3d> points = room_seen_from(Mount{}, 0.6, random);
  points.erase(points.begin(), points.begin() + 1500);
  EXPECT_FALSE(find_floor(points, up_in_sensor(Mount{})));
  EXPECT_FALSE(find_floor({}, Eigen::Vector3d::UnitZ()));
}

std::vector<ImuAttitude> at_rest(const Eigen::Vector3d& accel, const Eigen::Vector3d& gyro, double sigma = 0.02) {
  std::mt19937 random(6);
  std::normal_distribution<float> noise(0.0F, static_cast<float>(sigma));
  std::vector<ImuAttitude> samples(500);
  for (ImuAttitude& sample : samples) {
    for (int i = 0; i < 3; ++i) {
      const auto axis = static_cast<std::size_t>(i);
      sample.accel[axis] = static_cast<float>(accel[i]) + noise(random);
      sample.gyro[axis] = static_cast<float>(gyro[i]) + 0.02F * noise(random);
    }
  }
  return samples;
}

std::string first_suspicion(const Eigen::Vector3d& accel, const Eigen::Vector3d& gyro, double sigma = 0.02) {
  const auto found = suspicions(resting_imu(at_rest(accel, gyro, sigma)), mount_of(0.0, -45.0, 0.0));
  return found.empty() ? "" : found.front();
}

TEST(RestingImu, MeansAndSpreadsAreThoseOfTheSamples) {
  const RestingImu imu = resting_imu(at_rest({1.0, 2.0, 9.0}, {0.01, 0.0, -0.01}, 0.05));
  EXPECT_EQ(imu.samples, 500);
  EXPECT_NEAR((imu.mean_accel - Eigen::Vector3d(1.0, 2.0, 9.0)).norm(), 0.0, 0.01);
  EXPECT_NEAR(imu.sigma_accel.x(), 0.05, 0.006);
  EXPECT_NEAR(imu.sigma_gyro.y(), 0.001, 0.00012);
}

TEST(Suspicions, NameTheMistake) {
  const Eigen::Vector3d good = 9.81 * up_in_sensor(mount_of(0.0, -45.0, 0.0));
  EXPECT_EQ(first_suspicion(good, Eigen::Vector3d::Zero()), "");
  EXPECT_EQ(first_suspicion(good, Eigen::Vector3d::Zero(), 0.95), "");  // 0.06 m/s^2/sqrt(Hz) at 250 Hz
  EXPECT_NE(first_suspicion(good / 9.81, Eigen::Vector3d::Zero()).find("g instead of m/s^2"), std::string::npos);
  EXPECT_NE(first_suspicion(2.0 * good, Eigen::Vector3d::Zero()).find("wrong scale"), std::string::npos);
  EXPECT_NE(first_suspicion(-good, Eigen::Vector3d::Zero()).find("turned round"), std::string::npos);
  EXPECT_NE(first_suspicion({9.81, 0.0, 0.0}, Eigen::Vector3d::Zero()), "");
  EXPECT_NE(first_suspicion({0.0, 9.81, 0.0}, Eigen::Vector3d::Zero()).find("axes are swapped"), std::string::npos);
  EXPECT_NE(first_suspicion(good, {0.5, 0.0, 0.0}).find("degrees per second"), std::string::npos);
  EXPECT_NE(first_suspicion(good, Eigen::Vector3d::Zero(), 1.8).find("moves or shakes"), std::string::npos);
}

}  // namespace
}  // namespace ignis::l1
