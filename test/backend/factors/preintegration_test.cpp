// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/preintegration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/so3.h"

namespace ignis {
namespace {

constexpr Utime kStart = 5'000'000;
constexpr Utime kPeriod = 4'000;

std::vector<ImuSample> lively_samples(int count) {
  std::vector<ImuSample> samples;
  for (int i = 0; i < count; ++i) {
    const double t = 0.004 * i;
    ImuSample sample;
    sample.utime = kStart + i * kPeriod;
    sample.gyro = {0.5 * std::sin(3.0 * t), 0.8 * std::cos(2.0 * t), 0.3};
    sample.accel = {1.5 * std::cos(4.0 * t), 9.81 + std::sin(5.0 * t), -2.0 * std::sin(2.0 * t)};
    samples.push_back(sample);
  }
  return samples;
}

NavState start_state() {
  NavState state;
  state.utime = kStart;
  state.T_odom_body = {so3::exp({0.1, -0.7, 0.2}), {3.0, -1.0, 2.0}};
  state.v_odom = {0.4, 0.1, -1.2};
  state.gyro_bias = {0.01, -0.02, 0.005};
  state.accel_bias = {0.1, 0.05, -0.08};
  return state;
}

/// Slow and plain: each held sample in many small steps of the equations of motion in the world.
NavState reference_integration(NavState state, const std::vector<ImuSample>& samples, Utime end, double gravity) {
  constexpr int kSubSteps = 50;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Utime to = i + 1 < samples.size() ? samples[i + 1].utime : end;
    const double dt = seconds_between(samples[i].utime, to) / kSubSteps;
    for (int k = 0; k < kSubSteps; ++k) {
      const Eigen::Vector3d rate = samples[i].gyro - state.gyro_bias;
      const Eigen::Quaterniond middle = state.T_odom_body.rotation * so3::exp(0.5 * dt * rate);
      const Eigen::Vector3d a = middle * (samples[i].accel - state.accel_bias) + Eigen::Vector3d(0.0, -gravity, 0.0);
      state.T_odom_body.translation += dt * state.v_odom + 0.5 * dt * dt * a;
      state.v_odom += dt * a;
      state.T_odom_body.rotation = (state.T_odom_body.rotation * so3::exp(dt * rate)).normalized();
    }
  }
  return state;
}

TEST(Preintegration, AgreesWithPlainIntegration) {
  const std::vector<ImuSample> samples = lively_samples(250);
  const Utime end = kStart + 250 * kPeriod;
  const ImuNoise noise;
  const NavState expected = reference_integration(start_state(), samples, end, noise.gravity);
  const NavState state = predict_from_imu(start_state(), samples, end, noise).state;
  // What holding a sample in the body instead of the world costs over a second at 250 Hz.
  EXPECT_LT((state.T_odom_body.translation - expected.T_odom_body.translation).norm(), 0.01);
  EXPECT_LT((state.v_odom - expected.v_odom).norm(), 0.015);
  EXPECT_LT(state.T_odom_body.rotation.angularDistance(expected.T_odom_body.rotation), 1e-4);
  EXPECT_GT((expected.T_odom_body.translation - start_state().T_odom_body.translation).norm(), 0.5);
}

TEST(Preintegration, StaysPutAtRest) {
  std::vector<ImuSample> samples(500);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].utime = kStart + static_cast<Utime>(i) * kPeriod;
    samples[i].accel = {0.0, 9.81, 0.0};
  }
  NavState rest;
  rest.utime = kStart;
  const NavState state = predict_from_imu(rest, samples, kStart + 500 * kPeriod, ImuNoise()).state;
  EXPECT_LT(state.T_odom_body.translation.norm(), 1e-12);
  EXPECT_LT(state.v_odom.norm(), 1e-12);
}

TEST(Preintegration, HoldsTheFirstSampleFromTheStartAndTheLastToTheEnd) {
  ImuSample sample;
  sample.utime = kStart + 3'000;
  sample.gyro = {0.0, 1.0, 0.0};
  sample.accel = {0.0, 9.81, 0.0};
  NavState rest;
  rest.utime = kStart;
  const std::vector<ImuSample> one = {sample};
  const NavState state = predict_from_imu(rest, one, kStart + 100'000, ImuNoise()).state;
  EXPECT_NEAR(state.T_odom_body.rotation.angularDistance(Eigen::Quaterniond::Identity()), 0.1, 1e-9);
}

TEST(Preintegration, PredictsTheSpreadOfNoisyRuns) {
  const ImuNoise noise;
  const double per_sample = std::sqrt(250.0);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  NavState rest;
  rest.utime = kStart;
  constexpr int kRuns = 400;
  Eigen::Matrix<double, 9, 1> sum = Eigen::Matrix<double, 9, 1>::Zero();
  Eigen::Matrix<double, 9, 1> predicted;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<ImuSample> samples(250);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      samples[i].utime = kStart + static_cast<Utime>(i) * kPeriod;
      samples[i].accel = {0.0, 9.81, 0.0};
      for (int axis = 0; axis < 3; ++axis) {
        samples[i].gyro(axis) += noise.gyro_noise * per_sample * normal(random);
        samples[i].accel(axis) += noise.accel_noise * per_sample * normal(random);
      }
    }
    const ImuPrediction p = predict_from_imu(rest, samples, kStart + 250 * kPeriod, noise);
    sum.head<3>() += so3::log(p.state.T_odom_body.rotation).cwiseAbs2();
    sum.segment<3>(3) += p.state.T_odom_body.translation.cwiseAbs2();
    sum.tail<3>() += p.state.v_odom.cwiseAbs2();
    predicted = p.covariance.diagonal();
  }
  // The ratio of 400 squares to their expectation has a sigma of 0.07.
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(sum(i) / kRuns / predicted(i), 1.0, 0.28) << i;
}

TEST(Preintegration, RefusesSamplesThatWouldPoisonTheGraph) {
  const ImuNoise noise;
  const Utime end = kStart + 50 * kPeriod;
  const auto problem_after = [&](auto spoil) {
    std::vector<ImuSample> samples = lively_samples(50);
    spoil(samples);
    return imu_problem(samples, kStart, end, noise).has_value();
  };
  EXPECT_FALSE(problem_after([](auto&) {}));
  EXPECT_TRUE(problem_after([](auto& s) { s.clear(); }));
  EXPECT_TRUE(problem_after([](auto& s) { s[7].accel.x() = std::nan(""); }));
  EXPECT_TRUE(problem_after([](auto& s) { s[7].gyro.y() = INFINITY; }));
  EXPECT_TRUE(problem_after([](auto& s) { s[7].accel.x() = 1e24; }));
  EXPECT_TRUE(problem_after([](auto& s) { s[7].gyro.x() = 1e4; }));
  EXPECT_TRUE(problem_after([](auto& s) { s[7].utime = s[6].utime; }));
  EXPECT_TRUE(problem_after([](auto& s) { s[0].utime = kStart - 1; }));
  EXPECT_TRUE(problem_after([&](auto& s) { s.back().utime = end; }));
  const std::vector<ImuSample> samples = lively_samples(50);
  EXPECT_TRUE(imu_problem(samples, kStart, kStart, noise));
  EXPECT_TRUE(imu_problem(samples, kStart, end + 400'000, noise)) << "a gap at the end";
  EXPECT_TRUE(imu_problem(samples, kStart - 400'000, end, noise)) << "a gap at the start";
  ImuNoise short_interval;
  short_interval.max_interval_s = 0.1;
  EXPECT_TRUE(imu_problem(samples, kStart, end, short_interval));
}

}  // namespace
}  // namespace ignis
