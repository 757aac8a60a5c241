// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "common/so3.h"
#include "drivers/sim/imu_model.h"
#include "drivers/sim/scene_config.h"
#include "drivers/sim/shipped_scenes.h"

namespace ignis::sim {
namespace {

/// Attitude, velocity and position of an inertial unit in the world.
struct Inertial {
  Eigen::Vector4d q = Eigen::Vector4d::Zero();  ///< x, y, z, w
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();

  Inertial plus(const Inertial& slope, double step) const {
    return {q + step * slope.q, v + step * slope.v, p + step * slope.p};
  }
};

/// The strapdown equations: q' = q (0, gyro) / 2, v' = R(q) accel + g, p' = v.
Inertial slope(const Inertial& state, const ImuReading& reading) {
  const Eigen::Quaterniond q(state.q);
  const Eigen::Quaterniond rate(0.0, reading.gyro.x(), reading.gyro.y(), reading.gyro.z());
  return {0.5 * (q * rate).coeffs(), q.normalized() * reading.accel - Eigen::Vector3d(0.0, kGravity, 0.0), state.v};
}

/// One step of the classical Runge-Kutta method of fourth order; readings at the begin, middle and end of the step.
Inertial integrate(const Inertial& state, const std::array<ImuReading, 3>& readings, double step) {
  const Inertial k1 = slope(state, readings[0]);
  const Inertial k2 = slope(state.plus(k1, 0.5 * step), readings[1]);
  const Inertial k3 = slope(state.plus(k2, 0.5 * step), readings[1]);
  const Inertial k4 = slope(state.plus(k3, step), readings[2]);
  Inertial next = state.plus(k1, step / 6.0).plus(k2, step / 3.0).plus(k3, step / 3.0).plus(k4, step / 6.0);
  next.q.normalize();
  return next;
}

class ImuOfShippedScenes : public ::testing::TestWithParam<std::string> {};

/// Fourth order at 2 ms over the whole drive: no correction of any kind on the way, up to half an hour.
TEST_P(ImuOfShippedScenes, IntegratesBackToTheTrajectoryWithoutNoise) {
  const Trajectory drive(load_scene(test::scene_folder() / GetParam()).trajectory);
  const ImuModelConfig noiseless{.gyro_noise = 0.0,
                                 .accel_noise = 0.0,
                                 .gyro_bias = 0.0,
                                 .accel_bias = 0.0,
                                 .gyro_bias_walk = 0.0,
                                 .accel_bias_walk = 0.0};
  // Off the body's origin and turned, so that every term of the lever arm counts.
  const Pose T_body_imu{so3::exp({-0.7, 0.2, 0.4}), {0.3, -0.2, 0.5}};
  constexpr double kStep = 2e-3;
  ImuModel imu(noiseless, T_body_imu, 0.5 * kStep, 1);

  const Motion start = drive.at(0.0);
  const Pose T_world_imu = start.T_world_body * T_body_imu;
  Inertial state{T_world_imu.rotation.coeffs(),
                 start.v_world + start.T_world_body.rotation * start.rate_body.cross(T_body_imu.translation),
                 T_world_imu.translation};
  std::array<ImuReading, 3> readings;
  readings[2] = imu.sample(start);
  const int steps = static_cast<int>(drive.duration() / kStep);
  double worst_position = 0.0;
  for (int i = 0; i < steps; ++i) {
    readings = {readings[2], imu.sample(drive.at((i + 0.5) * kStep)), imu.sample(drive.at((i + 1) * kStep))};
    state = integrate(state, readings, kStep);
    if (i % 500 != 0 && i + 1 != steps) continue;
    const Pose truth = drive.at((i + 1) * kStep).T_world_body * T_body_imu;
    worst_position = std::max(worst_position, (state.p - truth.translation).norm());
    ASSERT_LT(truth.rotation.angularDistance(Eigen::Quaterniond(state.q)), 1e-8) << i * kStep;
  }
  EXPECT_LT(worst_position, 1e-5);
}

INSTANTIATE_TEST_SUITE_P(All, ImuOfShippedScenes, ::testing::ValuesIn(test::shipped_scenes()), test::kSceneName);

}  // namespace
}  // namespace ignis::sim
