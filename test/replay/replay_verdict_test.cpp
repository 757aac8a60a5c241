// SPDX-License-Identifier: Apache-2.0
#include "replay_verdict.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "replay_follower.h"

namespace ignis {
namespace {

/// One of a drive that stands, with a keyframe every 100 ms.
ScanResult scan_with_keyframe(std::int32_t id) {
  ScanResult scan;
  scan.has_state = true;
  scan.state.utime = 1'000'000 + 100'000 * id;
  scan.stats.utime = scan.state.utime;
  Keyframe keyframe;
  keyframe.id = id;
  keyframe.state = scan.state;
  keyframe.previous_utime = scan.state.utime - (id > 0 ? 100'000 : 0);
  keyframe.cloud = {{{1.0F, 2.0F, 3.0F}, 9.0F}};
  scan.keyframe = keyframe;
  scan.cloud = keyframe.cloud;
  return scan;
}

ReplayResult follow(const std::vector<ScanResult>& scans) {
  ReplayFollower follower({}, true, nullptr);
  for (const ScanResult& scan : scans) follower.take(scan, 0.1);
  return follower.finish();
}

LogInventory damaged_log() {
  LogInventory inventory;
  inventory.damaged_bytes = 1;
  return inventory;
}

TEST(ReplayVerdict, IsDoneWhereGraphAndMapTookEverything) {
  const ReplayResult result = follow({scan_with_keyframe(0), scan_with_keyframe(1)});
  EXPECT_EQ(result.keyframes_refused, 0);
  EXPECT_EQ(refusals(result), "");
  EXPECT_EQ(verdict(result, {}, false), runtime::kDone);
  EXPECT_EQ(verdict(result, {}, true), runtime::kFailed);
  EXPECT_EQ(verdict(result, damaged_log(), false), runtime::kInputDamaged);
}

TEST(ReplayVerdict, IsNotDoneWhereTheRunningNumbersOfTheLogHaveGaps) {
  const ReplayResult result = follow({scan_with_keyframe(0), scan_with_keyframe(1)});
  LogInventory inventory;
  inventory.out_of_order = 5;  // costs nothing
  EXPECT_EQ(verdict(result, inventory, false), runtime::kDone);
  inventory.missing_imu = 1;
  EXPECT_EQ(verdict(result, inventory, false), runtime::kInputDamaged);
  inventory.missing_imu = 0;
  inventory.missing_scans = 1;
  EXPECT_EQ(verdict(result, inventory, false), runtime::kInputDamaged);
}

TEST(ReplayVerdict, IsNotDoneWhereTheGraphRefusedAKeyframeInWhateverSession) {
  std::vector<ScanResult> scans{scan_with_keyframe(0), scan_with_keyframe(1), scan_with_keyframe(2)};
  scans[1].keyframe->state.v_odom.x() = std::numeric_limits<double>::quiet_NaN();
  scans[2].stats.session = scans[2].keyframe->session = 1;
  scans[2].keyframe->id = 0;
  const ReplayResult result = follow(scans);
  EXPECT_EQ(result.keyframes_refused, 1);
  EXPECT_EQ(refusals(result), "1 keyframes by the graph, the first: 1 of session 0: the velocity is not finite");
  EXPECT_EQ(verdict(result, {}, false), runtime::kInputDamaged);
}

TEST(ReplayVerdict, IsNotDoneWhereTheMapRefusedAPose) {
  std::vector<ScanResult> scans{scan_with_keyframe(0), scan_with_keyframe(1)};
  scans[1].keyframe.reset();
  scans[1].state.T_odom_body.translation.x() = 1e9;
  const ReplayResult result = follow(scans);
  EXPECT_EQ(refusals(result), "1 poses by the map");
  EXPECT_EQ(verdict(result, {}, false), runtime::kInputDamaged);
}

/// Leaps of hundreds of metres without IMU, each known to less than a micrometre: see Fault_G4 of the back end.
std::vector<ScanResult> hopeless_session(std::int32_t session) {
  std::mt19937 generator(static_cast<unsigned>(session));
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto number = [&] { return uniform(generator); };
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::vector<ScanResult> scans;
  for (std::int32_t id = 0; id < 25; ++id) {
    ScanResult scan = scan_with_keyframe(id);
    position += 740.0 * Eigen::Vector3d(number(), number(), number()).normalized();
    scan.stats.session = scan.keyframe->session = session;
    scan.state.utime = scan.keyframe->state.utime = (100 * session + 2 * id + 1) * 1'000'000;
    scan.keyframe->previous_utime = scan.state.utime - (id > 0 ? 2'000'000 : 0);
    scan.state.T_odom_body.translation = scan.keyframe->state.T_odom_body.translation = position;
    scan.keyframe->covariance = 1e-4 * Matrix15d::Identity();
    scan.keyframe->scan_information = 1e16 * Matrix6d::Identity();
    scans.push_back(std::move(scan));
  }
  return scans;
}

TEST(ReplayVerdict, IsAFailureWithItsReasonWhereAGraphFroze) {
  runtime::IgnisConfig config;
  config.backend.odometry_floor_m = 1e-6;
  config.backend.odometry_floor_rad = 1e-7;
  config.backend.scan_information_scale = 1.0;
  ReplayFollower follower(config, false, nullptr);
  for (std::int32_t session = 0; session < 20; ++session) {
    for (const ScanResult& scan : hopeless_session(session)) follower.take(scan, 0.1);
  }
  ScanResult last = scan_with_keyframe(0);
  last.stats.session = last.keyframe->session = 20;
  follower.take(last, 0.1);
  const ReplayResult result = follower.finish();
  ASSERT_TRUE(result.smoother.solver_failure.empty()) << "the newest session is well";
  try {
    static_cast<void>(verdict(result, damaged_log(), false));
    FAIL() << "it must not end like any other";
  } catch (const runtime::UserError& error) {
    EXPECT_EQ(error.code(), runtime::kFailed);
    EXPECT_NE(std::string(error.what()).find("cannot be rebuilt"), std::string::npos) << error.what();
  }
}

TEST(ReplayVerdict, IsAFailureWithoutAnyPose) {
  EXPECT_THROW(static_cast<void>(verdict({}, {}, false)), runtime::UserError);
}

}  // namespace
}  // namespace ignis
