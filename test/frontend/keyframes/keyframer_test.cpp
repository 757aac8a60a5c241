// SPDX-License-Identifier: Apache-2.0
#include "frontend/keyframes/keyframer.h"

#include <gtest/gtest.h>

#include "common/frames.h"

namespace ignis {
namespace {

/// Steps a keyframer through 20 Hz scans with five IMU samples each.
class Stepper {
 public:
  explicit Stepper(const FrontendConfig& config = {}) : keyframer(config, 3) {}

  std::optional<Keyframe> step(const Eigen::Vector3d& position, double yaw = 0.0, double speed = 0.0,
                               KeyframePace pace = KeyframePace::kAsDriven) {
    for (int i = 0; i < 5; ++i) {
      ImuSample sample;
      sample.utime = now + 10'000 * i;
      sample.accel = {0.0, 9.81, 0.0};
      keyframer.add_imu(sample);
    }
    now += 50'000;
    FilterState filter;
    filter.nominal.utime = now;
    filter.nominal.T_odom_body = {frames::from_yaw_pitch_roll({yaw, 0.0, 0.0}), position};
    filter.nominal.v_odom = {0.0, 0.0, -speed};
    return keyframer.add_scan(filter, Matrix6d::Identity(), {}, cloud, pace);
  }

  Keyframer keyframer;
  Utime now = 1'000'000;
  std::vector<CloudPoint> cloud = {{{1.0F, 0.0F, 0.0F}, 1.0F}};
};

TEST(Keyframer, FirstScanIsAlwaysAKeyframe) {
  Stepper stepper;
  const auto keyframe = stepper.step({0, 0, 0});
  ASSERT_TRUE(keyframe.has_value());
  EXPECT_EQ(keyframe->id, 0);
  EXPECT_EQ(keyframe->session, 3);
  EXPECT_EQ(keyframe->previous_utime, keyframe->state.utime);
  EXPECT_TRUE(keyframe->imu.empty());
  EXPECT_EQ(keyframe->scan_information.norm(), 0.0);
}

TEST(Keyframer, FiresOnDistance) {
  Stepper stepper;
  (void)stepper.step({0, 0, 0});
  EXPECT_FALSE(stepper.step({0, 0, -3.99}).has_value());
  const auto keyframe = stepper.step({0, 0, -4.01});
  ASSERT_TRUE(keyframe.has_value());
  EXPECT_EQ(keyframe->id, 1);
}

TEST(Keyframer, OfALostVehicleMakesOneASecondHoweverFastItSeemsToGo) {
  Stepper stepper;
  (void)stepper.step({0, 0, 0});
  int made = 0;
  for (int i = 1; i <= 100; ++i) made += stepper.step({0, 0, -5.0 * i}, 0.0, 100.0, KeyframePace::kSeldom) ? 1 : 0;
  EXPECT_EQ(made, 5) << "in five seconds";
  EXPECT_FALSE(stepper.step({0, 0, -600}, 0.0, 100.0, KeyframePace::kNone).has_value());
  EXPECT_TRUE(stepper.step({0, 0, -600}, 0.0, 100.0).has_value());
}

TEST(Keyframer, FiresOnTurnAcrossHalfATurn) {
  Stepper stepper;
  (void)stepper.step({0, 0, 0}, 3.0);
  EXPECT_FALSE(stepper.step({0, 0, 0}, 3.0 + 0.55).has_value());
  EXPECT_TRUE(stepper.step({0, 0, 0}, 3.0 + 0.65).has_value());
}

TEST(Keyframer, FiresOnTimeAndSaysThatItStoodStill) {
  Stepper stepper;
  (void)stepper.step({0, 0, 0});
  for (int i = 1; i < 100; ++i) ASSERT_FALSE(stepper.step({0, 0, 0}).has_value()) << i;
  const auto keyframe = stepper.step({0, 0, 0});
  ASSERT_TRUE(keyframe.has_value());
  EXPECT_TRUE(keyframe->stationary);
  EXPECT_EQ(keyframe->state.utime - keyframe->previous_utime, 5'000'000);
}

TEST(Keyframer, DrivingIsNotStationary) {
  Stepper stepper;
  (void)stepper.step({0, 0, 0});
  std::optional<Keyframe> keyframe;
  for (int i = 1; !keyframe; ++i) keyframe = stepper.step({0, 0, -0.005 * i}, 0.0, 0.1);
  EXPECT_FALSE(keyframe->stationary);
}

TEST(Keyframer, ImuSamplesCoverTheIntervalExactlyOnce) {
  Stepper stepper;
  (void)stepper.step({0, 0, 0});
  Utime expected = stepper.now;
  for (int k = 1; k <= 3; ++k) {
    const auto keyframe = stepper.step({0, 0, -5.0 * k});
    ASSERT_TRUE(keyframe.has_value());
    ASSERT_EQ(keyframe->imu.size(), 5U);
    for (const ImuSample& sample : keyframe->imu) {
      EXPECT_EQ(sample.utime, expected);
      expected += 10'000;
    }
    EXPECT_GE(keyframe->imu.front().utime, keyframe->previous_utime);
    EXPECT_LT(keyframe->imu.back().utime, keyframe->state.utime);
  }
}

TEST(Keyframer, AGapMarksItsIntervalOnly) {
  Stepper stepper;
  (void)stepper.step({0, 0, 0});
  stepper.keyframer.note_gap();
  EXPECT_FALSE(stepper.step({0, 0, -5})->imu_complete);
  EXPECT_TRUE(stepper.step({0, 0, -10})->imu_complete);
}

TEST(Keyframer, ForgetsSamplesOfAnIntervalThatIsTooLongToIntegrate) {
  Stepper stepper;
  stepper.step({0, 0, 0});
  for (int i = 0; i < 20 * 300; ++i) EXPECT_FALSE(stepper.step({0, 0, 0}, 0.0, 0.0, KeyframePace::kNone).has_value());
  const auto keyframe = stepper.step({0, 0, 0});
  ASSERT_TRUE(keyframe.has_value());
  EXPECT_FALSE(keyframe->imu_complete);
  EXPECT_LE(keyframe->imu.size(), 120U * 100U + 1U);
  const auto next = stepper.step({0, 0, -10.0});
  ASSERT_TRUE(next.has_value());
  EXPECT_TRUE(next->imu_complete);
}

TEST(Keyframer, InformationIsThatOfItsIntervalAlone) {
  Stepper stepper;
  (void)stepper.step({0, 0, 0});
  const auto informed = stepper.step({0, 0, -5});
  ASSERT_TRUE(informed.has_value());
  EXPECT_GT(informed->scan_information.norm(), 0.1);
  FilterState filter;
  filter.nominal.utime = stepper.now + 50'000;
  filter.nominal.T_odom_body.translation = {0.0, 0.0, -10.0};
  const auto uninformed = stepper.keyframer.add_scan(filter, Matrix6d::Zero(), {}, {});
  ASSERT_TRUE(uninformed.has_value());
  EXPECT_EQ(uninformed->scan_information.norm(), 0.0);
}

/// As a filter that has just taken `sighted` at (0, 0, -1) and drives on by 1 m/s.
FilterState corrected_by(const SightedSpeed& sighted, double velocity_variance, Utime now) {
  FilterState filter;
  filter.nominal.utime = now;
  filter.nominal.T_odom_body = {frames::from_yaw_pitch_roll({0.5, 0.0, 0.0}), {0.0, 0.0, -1.0}};
  filter.nominal.v_odom = sighted.speed * sighted.axis;
  filter.covariance.block<3, 3>(kVelocity, kVelocity) = velocity_variance * Eigen::Matrix3d::Identity();
  return filter;
}

TEST(Keyframer, HandsOnTheNewestSpeedThatAWallToldInAxesOfTheKeyframe) {
  Stepper stepper;
  (void)stepper.step({0, 0, 0});
  const SightedSpeed early{.axis = {0, 0, 1}, .speed = -0.9, .variance = 0.01};
  const SightedSpeed late{.axis = {0, 0, 1}, .speed = -1.0, .variance = 0.0025};
  stepper.keyframer.add_sighted(early, corrected_by(early, 0.002, stepper.now));
  FilterState filter = corrected_by(late, 0.001, stepper.now);
  stepper.keyframer.add_sighted(late, filter);
  filter.nominal.utime += 50'000;
  filter.nominal.T_odom_body.translation.z() = -5.0;
  filter.nominal.v_odom.z() += 0.25;  // it has braked meanwhile
  filter.covariance.block<3, 3>(kVelocity, kVelocity) = 0.004 * Eigen::Matrix3d::Identity();
  const auto keyframe = stepper.keyframer.add_scan(filter, Matrix6d::Zero(), {}, {});
  ASSERT_TRUE(keyframe && keyframe->sighted);
  const Eigen::Quaterniond R_odom_body = filter.nominal.T_odom_body.rotation;
  EXPECT_LT((R_odom_body * keyframe->sighted->axis - late.axis).norm(), 1e-12);
  EXPECT_NEAR(keyframe->sighted->speed, -0.75, 1e-12);
  EXPECT_NEAR(keyframe->sighted->variance, 0.0025 + 0.003, 1e-12);
  const auto next = stepper.step({0, 0, -10});
  ASSERT_TRUE(next);
  EXPECT_FALSE(next->sighted) << "of an earlier interval";
}

TEST(Keyframer, HandsOnNoSpeedOfAFilterThatWasReplaced) {
  Stepper stepper;
  (void)stepper.step({0, 0, 0});
  const SightedSpeed sighted{.axis = {0, 0, 1}, .speed = -1.0, .variance = 0.0025};
  stepper.keyframer.add_sighted(sighted, corrected_by(sighted, 0.001, stepper.now));
  stepper.keyframer.forget_sighted();
  const auto keyframe = stepper.step({0, 0, -5});
  ASSERT_TRUE(keyframe);
  EXPECT_FALSE(keyframe->sighted);
}

TEST(Keyframer, CloudHoldsTheLastSecondInTheKeyframesBodyFrame) {
  Stepper stepper;
  (void)stepper.step({0, 0, 0});
  std::optional<Keyframe> keyframe;
  for (int i = 1; i <= 40; ++i) {
    // The sensor sees one fixed point of the world; a second one appears only in the first half.
    const Eigen::Vector3d position(0.0, 0.0, -0.105 * i);
    stepper.cloud = {{(Eigen::Vector3d(1.0, 0.1, -6.0) - position).cast<float>(), 9.0F}};
    if (i < 15) stepper.cloud.push_back({(Eigen::Vector3d(3.0, 0.1, -6.0) - position).cast<float>(), 8.0F});
    if ((keyframe = stepper.step(position))) break;
  }
  ASSERT_TRUE(keyframe.has_value());
  ASSERT_EQ(keyframe->cloud.size(), 1U);
  const Eigen::Vector3d p = keyframe->state.T_odom_body * Eigen::Vector3d(keyframe->cloud[0].position.cast<double>());
  EXPECT_LT((p - Eigen::Vector3d(1.0, 0.1, -6.0)).norm(), 1e-4);
}

}  // namespace
}  // namespace ignis
