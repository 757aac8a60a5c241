// SPDX-License-Identifier: Apache-2.0
#include "frontend/trust/second_opinion.h"

#include <gtest/gtest.h>

namespace ignis {
namespace {

const Eigen::Vector3d kAxis = Eigen::Vector3d::UnitZ();

/// Scans at 20 Hz of a vehicle whose IMU knows what it does: velocity to 0.02 m/s, acceleration to 0.02 m/s^2.
class Drive {
 public:
  explicit Drive(const FrontendConfig& config = {}) : opinion(config) {
    state_.nominal.utime = 1'000'000'000;
    state_.covariance = 1e-8 * ErrorCovariance::Identity();
    state_.covariance.block<3, 3>(kVelocity, kVelocity) = 4e-4 * Eigen::Matrix3d::Identity();
    state_.covariance.block<3, 3>(kAccelBias, kAccelBias) = 4e-4 * Eigen::Matrix3d::Identity();
    facing.diagonal() << 0.5, 0.495, 0.005;
  }

  /// Scans that each add so much to the velocity along the axis.
  void run(double seconds, double per_second) {
    for (int i = 0; i < static_cast<int>(20.0 * seconds); ++i) {
      state_.nominal.utime += 50'000;
      state_.nominal.v_odom += per_second / 20.0 * kAxis;
      opinion.note_scan(state_, per_second / 20.0 * kAxis, facing);
    }
  }
  void know_velocity_to(double sigma) {
    state_.covariance.block<3, 3>(kVelocity, kVelocity) = sigma * sigma * Eigen::Matrix3d::Identity();
  }
  [[nodiscard]] Utime now() const { return state_.nominal.utime; }

  SecondOpinion opinion;
  Eigen::Matrix3d facing = Eigen::Matrix3d::Zero();

 private:
  FilterState state_;
};

TEST(SecondOpinion, FindsAVelocityThatScansTakeBackALittleAtATime) {
  Drive drive;
  drive.run(3.0, 0.0);
  EXPECT_FALSE(drive.opinion.contradiction());
  drive.run(2.0, -0.4);
  const auto found = drive.opinion.contradiction();
  ASSERT_TRUE(found);
  EXPECT_NEAR(std::abs(found->direction.dot(kAxis)), 1.0, 1e-9);
  // 0.8 m/s beside the noise of 2.0 to 2.5 s at 0.06 m/s^2/sqrt(Hz), 0.02 m/s and 0.02 m/s^2.
  EXPECT_GT(found->sigmas, 7.0);
  EXPECT_LT(found->sigmas, 8.6);
}

TEST(SecondOpinion, GoesBackToBeforeTheWindow) {
  Drive drive;
  drive.run(3.0, 0.0);
  drive.run(2.0, -0.4);
  const double age = seconds_between(drive.opinion.contradiction().value().since.nominal.utime, drive.now());
  EXPECT_GE(age, 1.95);
  EXPECT_LE(age, 2.55) << "the IMU is kept for three seconds";
}

TEST(SecondOpinion, HasNothingToSayOfWhatNoiseAndBiasExplain) {
  Drive drive;
  drive.run(10.0, 0.15);
  EXPECT_FALSE(drive.opinion.contradiction());
}

TEST(SecondOpinion, LetsCorrectionsCancelOut) {
  Drive drive;
  for (int i = 0; i < 40; ++i) {
    drive.run(0.05, 4.0);
    drive.run(0.05, -4.0);
  }
  EXPECT_FALSE(drive.opinion.contradiction());
}

TEST(SecondOpinion, LeavesADirectionThatManyPlanesFaceToTheScans) {
  Drive drive;
  drive.facing.diagonal() << 0.3, 0.3, 0.4;
  drive.run(5.0, -0.4);
  EXPECT_FALSE(drive.opinion.contradiction());
}

TEST(SecondOpinion, HasToBeSurerWhereSomeOfThePlanesFaceTheDirection) {
  Drive drive;
  drive.facing.diagonal() << 0.45, 0.45, 0.1;
  drive.run(3.0, 0.0);
  drive.run(2.0, -0.3);  // 5.4 to 6.3 sigma
  EXPECT_FALSE(drive.opinion.contradiction());
  drive.run(2.0, -0.5);
  EXPECT_TRUE(drive.opinion.contradiction());
}

TEST(SecondOpinion, LetsScansTellAVelocityThatWasNotKnown) {
  Drive drive;
  drive.know_velocity_to(0.5);
  drive.run(5.0, -0.4);
  EXPECT_FALSE(drive.opinion.contradiction());
}

TEST(SecondOpinion, BeginsAnewWhereNothingCanBeDeadReckoned) {
  Drive drive;
  drive.run(2.0, -0.4);
  ASSERT_TRUE(drive.opinion.contradiction());
  drive.opinion.forget();
  EXPECT_FALSE(drive.opinion.contradiction());
  drive.run(0.5, -0.4);
  EXPECT_FALSE(drive.opinion.contradiction());
}

TEST(SecondOpinion, LetsScansTellTheVelocityOfAStartInMotion) {
  Drive drive;
  drive.opinion.begin(drive.now());
  for (int i = 0; i < 80; ++i) {
    drive.run(0.05, -0.5);
    ASSERT_FALSE(drive.opinion.contradiction());
  }
  drive.run(8.5, -0.5);
  EXPECT_FALSE(drive.opinion.contradiction());
}

TEST(SecondOpinion, IsHeardTenSecondsAfterAStartInMotionWhateverItSaidMeanwhile) {
  Drive drive;
  drive.opinion.begin(drive.now());
  // The last scan of the first three seconds is 2.95 s after the start.
  for (int i = 1; i < 20 * 12.95; ++i) {
    drive.run(0.05, -0.5);
    ASSERT_FALSE(drive.opinion.contradiction()) << i;
  }
  drive.run(0.05, -0.5);
  EXPECT_TRUE(drive.opinion.contradiction());
}

TEST(SecondOpinion, IsHeardThreeSecondsAfterAStartAtRest) {
  Drive drive;
  drive.opinion.begin(drive.now());
  for (int i = 0; i < 60; ++i) {
    drive.run(0.05, 0.05);
    ASSERT_FALSE(drive.opinion.contradiction());
  }
  drive.run(2.0, -0.5);
  EXPECT_TRUE(drive.opinion.contradiction());
}

TEST(SecondOpinion, IsNotAskedWhenTurnedOff) {
  FrontendConfig config;
  config.contradiction_sigma = 0.0;
  Drive drive(config);
  drive.run(5.0, -1.0);
  EXPECT_FALSE(drive.opinion.contradiction());
}

}  // namespace
}  // namespace ignis
