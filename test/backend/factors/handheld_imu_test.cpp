// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "backend/factors/preintegration.h"
#include "backend/recorded_data.h"
#include "backend/smoother.h"
#include "common/frames.h"
#include "common/trajectory_file.h"

/// A real handheld recording: inertial samples at 100 Hz beside poses at 10 Hz of unknown but good origin.
namespace ignis {
namespace {

constexpr std::size_t kWindow = 10;  // poses in a second
constexpr std::size_t kStride = 30;

Utime parse_stamp(const std::string& text) {
  const std::size_t dot = text.find('.');
  return std::stoll(text.substr(0, dot)) * kMicrosPerSecond + std::stoll(text.substr(dot + 1, 6));
}

std::vector<ImuSample> read_samples(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<ImuSample> samples;
  std::string line;
  while (std::getline(in, line)) {
    std::istringstream fields(line);
    std::string stamp;
    ImuSample s;
    fields >> stamp >> s.accel.x() >> s.accel.y() >> s.accel.z() >> s.gyro.x() >> s.gyro.y() >> s.gyro.z();
    s.utime = parse_stamp(stamp);
    samples.push_back(s);
  }
  return samples;
}

/// The recording's world has Z up; ours has Y up.
Trajectory read_poses(const std::filesystem::path& file) {
  const Pose T_ours_theirs{frames::q_body_from_forward_left_up(), Eigen::Vector3d::Zero()};
  Trajectory trajectory = read_tum(file);
  for (StampedPose& pose : trajectory) pose.T_world_body = T_ours_theirs * pose.T_world_body;
  return trajectory;
}

class HandheldImu : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto folder = testing::recorded_data("handheld_imu_100hz");
    IGNIS_REQUIRE_DATA(folder);
    samples_ = read_samples(folder / "imu.txt");
    poses_ = read_poses(folder / "traj.txt");
    ASSERT_GT(samples_.size(), 20000U);
    ASSERT_GT(poses_.size(), 2000U);
  }

  [[nodiscard]] std::vector<ImuSample> between(Utime start, Utime end) const {
    std::vector<ImuSample> inside;
    for (const ImuSample& sample : samples_) {
      if (sample.utime >= start && sample.utime < end) inside.push_back(sample);
    }
    return inside;
  }
  [[nodiscard]] NavState state_at(std::size_t i) const {
    NavState state;
    state.utime = poses_[i].utime;
    state.T_odom_body = poses_[i].T_world_body;
    state.v_odom = (poses_[i + 1].T_world_body.translation - poses_[i - 1].T_world_body.translation) /
                   seconds_between(poses_[i - 1].utime, poses_[i + 1].utime);
    return state;
  }

  [[nodiscard]] NavState smoothed_with(const Eigen::Vector3d& gyro_bias, const Eigen::Vector3d& accel_bias) const;

  std::vector<ImuSample> samples_;
  Trajectory poses_;
};

TEST_F(HandheldImu, DeadReckonsASecondWithinTheSigmaThatItPredicts) {
  const ImuNoise noise;
  int windows = 0;
  int inside = 0;
  double position = 0.0;
  double rotation = 0.0;
  for (std::size_t i = 10; i + kWindow + 1 < poses_.size(); i += kStride) {
    const NavState from = state_at(i);
    const StampedPose& truth = poses_[i + kWindow];
    const std::vector<ImuSample> samples = between(from.utime, truth.utime);
    if (imu_problem(samples, from.utime, truth.utime, noise)) continue;
    const ImuPrediction p = predict_from_imu(from, samples, truth.utime, noise);
    const Vector6d error = body_difference(p.state.T_odom_body, truth.T_world_body);
    position += error.tail<3>().norm();
    rotation += error.head<3>().norm();
    const Eigen::Matrix<double, 3, 3> covariance = p.covariance.block<3, 3>(3, 3);
    const Eigen::Vector3d e_start =
        from.T_odom_body.rotation.conjugate() * (truth.T_world_body.translation - p.state.T_odom_body.translation);
    if (e_start.dot(covariance.inverse() * e_start) < 11.34) ++inside;  // 99 % of chi-square, 3 degrees
    ++windows;
  }
  ASSERT_GT(windows, 70);
  std::printf("%d windows of 1 s: mean error %.2f cm, %.3f deg; inside 99 %% sigma: %d\n", windows,
              100.0 * position / windows, rotation / windows * 57.29578, inside);
  EXPECT_LT(position / windows, 0.02);
  EXPECT_LT(rotation / windows * 57.29578, 0.1);
  EXPECT_GE(inside, windows * 97 / 100);
}

/// Biases of the newest of ninety keyframes, a second apart, when so much is added to the samples.
NavState HandheldImu::smoothed_with(const Eigen::Vector3d& gyro_bias, const Eigen::Vector3d& accel_bias) const {
  BackendConfig config;
  config.use_loop_closing = false;
  Smoother smoother(config, LoopGates());
  SmootherUpdate update;
  for (int id = 0; id < 90; ++id) {
    Keyframe keyframe;
    keyframe.id = id;
    keyframe.state = state_at(1 + kWindow * static_cast<std::size_t>(id));
    keyframe.previous_utime = id == 0 ? keyframe.state.utime : update.newest.utime;
    keyframe.covariance *= 1e-4;
    keyframe.scan_information.diagonal() << Eigen::Vector3d::Constant(1.0 / (0.002 * 0.002)),
        Eigen::Vector3d::Constant(1.0 / (0.01 * 0.01));
    keyframe.imu = between(keyframe.previous_utime, keyframe.state.utime);
    for (ImuSample& sample : keyframe.imu) {
      sample.gyro += gyro_bias;
      sample.accel += accel_bias;
    }
    update = smoother.add_keyframe(keyframe);
    EXPECT_TRUE(update.accepted()) << update.reason;
  }
  return update.newest;
}

TEST_F(HandheldImu, TheBiasesThatWereAddedToItAreFound) {
  const Eigen::Vector3d gyro_bias(0.01, -0.006, 0.008);
  const Eigen::Vector3d accel_bias(0.1, -0.08, 0.06);
  const NavState as_it_is = smoothed_with(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  const NavState biased = smoothed_with(gyro_bias, accel_bias);
  const Eigen::Vector3d gyro_error = biased.gyro_bias - as_it_is.gyro_bias - gyro_bias;
  const Eigen::Vector3d accel_error = biased.accel_bias - as_it_is.accel_bias - accel_bias;
  std::printf("own biases %.5f rad/s, %.4f m/s^2; of what was added %.6f rad/s, %.5f m/s^2 are missing\n",
              as_it_is.gyro_bias.norm(), as_it_is.accel_bias.norm(), gyro_error.norm(), accel_error.norm());
  EXPECT_LT(as_it_is.gyro_bias.norm(), 0.002) << "the recording has hardly any";
  EXPECT_LT(as_it_is.accel_bias.norm(), 0.05);
  EXPECT_LT(gyro_error.norm(), 1e-4);
  EXPECT_LT(accel_error.norm(), 0.01);
}

TEST_F(HandheldImu, SeesGravityDownward) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  int count = 0;
  std::size_t k = 0;
  for (const StampedPose& pose : poses_) {
    while (k < samples_.size() && samples_[k].utime < pose.utime) ++k;
    if (k == samples_.size() || samples_[k].utime - pose.utime > 10'000) continue;
    mean += pose.T_world_body.rotation * samples_[k].accel;
    ++count;
  }
  mean /= count;
  EXPECT_NEAR(mean.x(), 0.0, 0.05);
  EXPECT_NEAR(mean.y(), 9.81, 0.05);
  EXPECT_NEAR(mean.z(), 0.0, 0.05);
}

}  // namespace
}  // namespace ignis
