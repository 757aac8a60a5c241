// SPDX-License-Identifier: Apache-2.0
#include "backend/smoother.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "backend/factors/scan_trust.h"
#include "backend/synthetic_drive.h"
#include "backend/text_contains.h"
#include "common/config_check.h"
#include "common/fingerprint.h"

namespace ignis {
namespace {

using testing::contains;

BackendConfig without_loops() {
  BackendConfig config;
  config.use_loop_closing = false;
  return config;
}

std::vector<Pose> poses_of(const Smoother& smoother) {
  std::vector<Pose> poses;
  for (const KeyframePose& pose : smoother.all_poses()) poses.push_back(pose.T_map_body);
  return poses;
}

Smoother filled(const std::vector<Keyframe>& keyframes, std::size_t count) {
  Smoother smoother(without_loops(), LoopGates());
  for (std::size_t i = 0; i < count; ++i) EXPECT_TRUE(smoother.add_keyframe(keyframes[i]).accepted());
  return smoother;
}

TEST(Smoother, KeepsARestingVehicleInItsPlace) {
  Smoother smoother(without_loops(), LoopGates());
  SmootherUpdate last;
  for (const Keyframe& keyframe : testing::make_rest(30, 5)) {
    last = smoother.add_keyframe(keyframe);
    ASSERT_TRUE(last.accepted()) << last.reason;
  }
  // Twenty-nine seconds on the wrong sign of gravity would be kilometres.
  for (const Pose& pose : poses_of(smoother)) EXPECT_LT(pose.translation.norm(), 0.25);
  EXPECT_LT(last.newest.v_odom.norm(), 0.03);
  EXPECT_EQ(smoother.stats().without_imu, 0);
}

TEST(Smoother, ImuAddsToOdometry) {
  double with = 0.0;
  double odometry = 0.0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const testing::Drive drive = testing::make_drive({.seed = seed, .keyframes = 30});
    with += testing::position_error(poses_of(filled(drive.keyframes, 30)), drive.T_world_body);
    std::vector<Pose> chain;
    for (const Keyframe& keyframe : drive.keyframes) chain.push_back(keyframe.state.T_odom_body);
    odometry += testing::position_error(chain, drive.T_world_body);
  }
  EXPECT_LT(with, odometry);
}

TEST(Smoother, CountsTheScanInformationOnce) {
  testing::Drive drive = testing::make_drive({.keyframes = 2});
  BackendConfig config = without_loops();
  config.imu.accel_noise = 10.0;  // so weak that only scan matching speaks
  config.imu.gyro_noise = 1.0;
  config.scan_information_scale = 0.5;
  config.prior_tilt_deg = 0.01;
  config.prior_yaw_rad = config.prior_position_m = 1e-5;
  Smoother smoother(config, LoopGates());
  static_cast<void>(smoother.add_keyframe(drive.keyframes[0]));
  const SmootherUpdate update = smoother.add_keyframe(drive.keyframes[1]);
  ASSERT_TRUE(update.covariance_valid);
  const Vector6d variance = update.covariance.diagonal();
  const double rotation = 0.005 * 0.005 / 0.5 + config.odometry_floor_rad * config.odometry_floor_rad;
  const double position = 0.02 * 0.02 / 0.5 + config.odometry_floor_m * config.odometry_floor_m;
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(variance(i) / rotation, 1.0, 0.03);
    EXPECT_NEAR(variance(3 + i) / position, 1.0, 0.03);
  }
}

TEST(Smoother, BelievesLittleOfWhatScansHardlyObserve) {
  testing::Drive drive = testing::make_drive({.keyframes = 2});
  BackendConfig config = without_loops();
  config.imu.accel_noise = 10.0;
  config.imu.gyro_noise = 1.0;
  Matrix6d& information = drive.keyframes[1].scan_information;
  information(5, 5) *= 0.01;
  Smoother smoother(config, LoopGates());
  static_cast<void>(smoother.add_keyframe(drive.keyframes[0]));
  const SmootherUpdate update = smoother.add_keyframe(drive.keyframes[1]);
  ASSERT_TRUE(update.covariance_valid);
  EXPECT_NEAR(update.covariance(5, 5) * trusted_information(information)(5, 5), 1.0, 0.1);
  EXPECT_GT(update.covariance(5, 5) * information(5, 5), 5.0);
}

TEST(Smoother, WantsKeyframesInOrder) {
  const testing::Drive drive = testing::make_drive({.keyframes = 8});
  Smoother smoother = filled(drive.keyframes, 5);
  const auto before = poses_of(smoother);
  const SmootherUpdate gap = smoother.add_keyframe(drive.keyframes[6]);
  EXPECT_EQ(gap.verdict, KeyframeVerdict::kGap);
  EXPECT_TRUE(contains(gap.reason, "gap: expected id 5"));
  EXPECT_EQ(gap.expected_id, 5);
  const SmootherUpdate duplicate = smoother.add_keyframe(drive.keyframes[3]);
  EXPECT_EQ(duplicate.verdict, KeyframeVerdict::kDuplicate);
  EXPECT_TRUE(duplicate.moved.empty());
  EXPECT_EQ(smoother.all_poses().size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(poses_of(smoother)[i].translation, before[i].translation);
  for (std::size_t i = 5; i < 8; ++i) {
    EXPECT_EQ(smoother.add_keyframe(drive.keyframes[i]).verdict, KeyframeVerdict::kAccepted);
  }
  EXPECT_EQ(smoother.stats().gaps, 1);
  EXPECT_EQ(smoother.stats().duplicates, 1);
}

TEST(Smoother, GivesTheSameGraphWhateverWasSentTwiceOrTooEarly) {
  const testing::Drive drive = testing::make_drive({.keyframes = 12});
  const auto straight = poses_of(filled(drive.keyframes, 12));
  Smoother smoother(without_loops(), LoopGates());
  for (std::size_t i = 0; i < 12; ++i) {
    if (i + 1 < 12) static_cast<void>(smoother.add_keyframe(drive.keyframes[i + 1]));
    static_cast<void>(smoother.add_keyframe(drive.keyframes[i]));
    static_cast<void>(smoother.add_keyframe(drive.keyframes[i / 2]));
  }
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(poses_of(smoother)[i].translation, straight[i].translation);
    EXPECT_EQ(poses_of(smoother)[i].rotation.coeffs(), straight[i].rotation.coeffs());
  }
}

TEST(Smoother, LinksAcrossIdsThatNobodyCanSend) {
  const testing::Drive drive = testing::make_drive({.keyframes = 9});
  Smoother smoother = filled(drive.keyframes, 4);
  smoother.accept_gap_before(6);
  for (std::size_t i = 6; i < 9; ++i) {
    const SmootherUpdate update = smoother.add_keyframe(drive.keyframes[i]);
    ASSERT_TRUE(update.accepted()) << update.reason;
    if (i == 6) {
      EXPECT_TRUE(contains(update.reason, "without IMU"));
    }
  }
  EXPECT_EQ(smoother.all_poses().back().id, 8);
  EXPECT_LT((smoother.all_poses().back().T_map_body.translation - drive.T_world_body[8].translation).norm(), 0.5);
}

TEST(Smoother, TakesNoKeyframeThatNoneCanFollow) {
  constexpr std::int32_t kLast = std::numeric_limits<std::int32_t>::max();
  const testing::Drive drive = testing::make_drive({.keyframes = 6});
  Smoother smoother = filled(drive.keyframes, 5);
  smoother.accept_gap_before(kLast);
  Keyframe last = drive.keyframes[5];
  last.id = kLast;
  const SmootherUpdate update = smoother.add_keyframe(last);
  EXPECT_EQ(update.verdict, KeyframeVerdict::kInvalid);
  EXPECT_EQ(update.reason, "no id can follow this one");
  EXPECT_EQ(smoother.expected_id(), kLast) << "there is none behind it";
}

TEST(Smoother, RefusesWhatIsNotFiniteAndStaysAsItWas) {
  const testing::Drive drive = testing::make_drive({.keyframes = 8});
  const double nan = std::nan("");
  const std::map<std::string, void (*)(Keyframe&, double)> spoilers = {
      {"pose", [](Keyframe& k, double v) { k.state.T_odom_body.translation.y() = v; }},
      {"velocity", [](Keyframe& k, double v) { k.state.v_odom.x() = v; }},
      {"bias", [](Keyframe& k, double v) { k.state.gyro_bias.z() = v; }},
      {"information", [](Keyframe& k, double v) { k.scan_information(2, 4) = v; }},
      {"covariance is not finite", [](Keyframe& k, double v) { k.covariance(1, 3) = v; }},
      {"sighted speed is not finite", [](Keyframe& k, double v) { k.sighted = SightedSpeed{.speed = v}; }},
      {"sighted speed is known absurdly well", [](Keyframe& k, double) { k.sighted = SightedSpeed{}; }},
      {"sighted speed's axis", [](Keyframe& k, double) { k.sighted = SightedSpeed{.axis = {2, 0, 0}, .variance = 1}; }},
      {"sighted speed is absurd", [](Keyframe& k, double) { k.sighted = SightedSpeed{.speed = 1e3, .variance = 1}; }},
      {"covariance is absurd", [](Keyframe& k, double) { k.covariance(4, 4) = 1e200; }},
      {"symmetric", [](Keyframe& k, double) { k.scan_information(2, 4) = 1e3; }},
      {"unit length", [](Keyframe& k, double) { k.state.T_odom_body.rotation.coeffs() *= 1.1; }},
      {"leap", [](Keyframe& k, double) { k.state.T_odom_body.translation.x() += 2000.0; }},
      {"stamp", [](Keyframe& k, double) { k.state.utime = k.previous_utime; }}};
  for (const auto& [word, spoil] : spoilers) {
    Smoother smoother = filled(drive.keyframes, 5);
    const auto before = poses_of(smoother);
    Keyframe bad = drive.keyframes[5];
    spoil(bad, nan);
    const SmootherUpdate update = smoother.add_keyframe(bad);
    EXPECT_EQ(update.verdict, KeyframeVerdict::kInvalid);
    EXPECT_TRUE(contains(update.reason, word));
    ASSERT_EQ(smoother.all_poses().size(), 5U);
    for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(poses_of(smoother)[i].translation, before[i].translation);
    // The chain goes on across the keyframe that was dropped.
    const SmootherUpdate next = smoother.add_keyframe(drive.keyframes[6]);
    EXPECT_TRUE(next.accepted()) << next.reason;
    EXPECT_TRUE(smoother.all_poses().back().T_map_body.all_finite());
  }
}

/// Sane one by one, but no digits are left for the attitudes: leaps of hundreds of metres that odometry claims to know
/// to a micrometre, without IMU.
std::vector<Keyframe> numerically_hopeless(std::vector<Keyframe> keyframes, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto number = [&] { return uniform(generator); };
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  for (Keyframe& keyframe : keyframes) {
    position += 740.0 * Eigen::Vector3d(number(), number(), number()).normalized();
    keyframe.state.T_odom_body.translation = position;
    keyframe.scan_information *= 1e12;
    keyframe.imu_complete = false;
  }
  return keyframes;
}

/// What makes such odometry believed.
BackendConfig trusting_odometry() {
  BackendConfig config = without_loops();
  config.odometry_floor_m = 1e-6;
  config.odometry_floor_rad = 1e-7;
  config.scan_information_scale = 1.0;
  return config;
}

TEST(Smoother, DropsAKeyframeThatTheSolverRefusesAndStaysAsItWas) {
  const BackendConfig config = trusting_odometry();
  const testing::Drive drive = testing::make_drive({.keyframes = 25});
  int refusals = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Smoother smoother(config, LoopGates());
    for (const Keyframe& keyframe : numerically_hopeless(drive.keyframes, seed)) {
      const std::size_t size = smoother.all_poses().size();
      const std::int32_t revision = smoother.revision();
      const SmootherUpdate update = smoother.add_keyframe(keyframe);
      EXPECT_EQ(update.expected_id, keyframe.id + 1);
      if (!update.accepted()) {
        ++refusals;
        EXPECT_EQ(update.verdict, KeyframeVerdict::kSolver);
        EXPECT_FALSE(update.reason.empty());
        EXPECT_EQ(smoother.all_poses().size(), size);
        EXPECT_EQ(smoother.revision(), revision);
      }
      for (const Pose& pose : poses_of(smoother)) ASSERT_TRUE(pose.all_finite());
    }
    EXPECT_EQ(smoother.stats().invalid + smoother.stats().keyframes, 25);
  }
  EXPECT_GT(refusals, 0);
}

TEST(Fault_G4, ASolverThatCannotEvenBeRebuiltSaysSoAndKeepsItsLastSolution) {
  const BackendConfig config = trusting_odometry();
  const testing::Drive drive = testing::make_drive({.keyframes = 25});
  int broken = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Smoother smoother(config, LoopGates());
    std::vector<Pose> last;
    for (const Keyframe& keyframe : numerically_hopeless(drive.keyframes, seed)) {
      const std::string failure = smoother.stats().solver_failure;
      const SmootherUpdate update = smoother.add_keyframe(keyframe);
      if (!failure.empty()) {
        EXPECT_EQ(update.reason, failure) << "whatever comes is refused, with the reason";
        EXPECT_EQ(smoother.stats().solver_failure, failure);
        ASSERT_EQ(poses_of(smoother).size(), last.size());
        for (std::size_t i = 0; i < last.size(); ++i) EXPECT_EQ(poses_of(smoother)[i].translation, last[i].translation);
      }
      last = poses_of(smoother);
    }
    if (smoother.stats().solver_failure.empty()) continue;
    ++broken;
    EXPECT_TRUE(contains(smoother.stats().solver_failure, "cannot be rebuilt"));
    EXPECT_FALSE(smoother.withdraw_loop(10, 0).covariance_valid) << "a command finds no covariance, and no crash";
  }
  EXPECT_GT(broken, 0);
}

TEST(Smoother, DoesWithoutImuThatIsIncompleteOrBroken) {
  const testing::Drive drive = testing::make_drive({.keyframes = 8});
  const std::map<std::string, void (*)(Keyframe&)> spoilers = {
      {"IMU gap", [](Keyframe& k) { k.imu_complete = false; }},
      {"not finite", [](Keyframe& k) { k.imu[20].gyro.x() = std::nan(""); }},
      {"no IMU samples", [](Keyframe& k) { k.imu.clear(); }},
      {"does not begin", [](Keyframe& k) { k.previous_utime -= 5; }},
      {"no IMU samples", [](Keyframe& k) {
         k.imu.clear();
         k.scan_information.setZero();
       }}};
  for (const auto& [word, spoil] : spoilers) {
    Smoother smoother = filled(drive.keyframes, 5);
    Keyframe bad = drive.keyframes[5];
    spoil(bad);
    const SmootherUpdate update = smoother.add_keyframe(bad);
    EXPECT_TRUE(update.accepted());
    EXPECT_TRUE(contains(update.reason, word));
    EXPECT_EQ(smoother.stats().without_imu, 1);
    const SmootherUpdate next = smoother.add_keyframe(drive.keyframes[6]);
    EXPECT_TRUE(next.accepted() && next.reason.empty()) << next.reason;
    EXPECT_LT((next.newest.T_odom_body.translation - drive.T_world_body[6].translation).norm(), 0.5);
  }
}

TEST(Smoother, KeepsToOneSession) {
  const testing::Drive drive = testing::make_drive({.keyframes = 4});
  Smoother smoother = filled(drive.keyframes, 3);
  Keyframe other = drive.keyframes[3];
  other.session = 1;
  EXPECT_EQ(smoother.add_keyframe(other).verdict, KeyframeVerdict::kOtherSession);
  EXPECT_TRUE(smoother.add_keyframe(drive.keyframes[3]).accepted());
}

TEST(Smoother, ListsWhatMovedSoThatAReceiverCanFollow) {
  const testing::Drive drive = testing::make_drive({.seed = 3, .keyframes = 30, .cloud_points = 3000});
  Smoother smoother{BackendConfig(), LoopGates()};
  std::map<std::int32_t, Pose> receiver;
  std::int32_t revision = 0;
  for (const Keyframe& keyframe : drive.keyframes) {
    const SmootherUpdate update = smoother.add_keyframe(keyframe);
    EXPECT_EQ(update.revision, ++revision);
    for (const KeyframePose& pose : update.moved) receiver[pose.id] = pose.T_map_body;
    ASSERT_EQ(receiver.size(), smoother.all_poses().size());
    for (const KeyframePose& pose : smoother.all_poses()) {
      const Vector6d stale = body_difference(receiver.at(pose.id), pose.T_map_body);
      EXPECT_LE(stale.head<3>().norm(), 1.01e-5);
      EXPECT_LE(stale.tail<3>().norm(), 1.01e-4);
    }
    const Pose T_map_body = update.T_map_odom * keyframe.state.T_odom_body;
    EXPECT_LT(body_difference(T_map_body, smoother.all_poses().back().T_map_body).norm(), 1e-9);
  }
}

TEST(Smoother, NamesEveryOffenceOfItsConfiguration) {
  BackendConfig config;
  config.prior_tilt_deg = -1.0;
  config.imu.gyro_noise = 0.0;
  config.matcher.last_radius_m = 5.0;
  try {
    Smoother smoother(config, LoopGates());
    FAIL();
  } catch (const config::ConfigError& error) {
    EXPECT_TRUE(contains(error.what(), "backend.prior_tilt_deg"));
    EXPECT_TRUE(contains(error.what(), "backend.imu.gyro_noise"));
    EXPECT_TRUE(contains(error.what(), "backend.matcher.last_radius_m"));
  }
}

}  // namespace
}  // namespace ignis
