// SPDX-License-Identifier: Apache-2.0
#include "frontend/lio.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

#include "common/so3.h"
#include "frontend/lio_runner.h"

namespace ignis {
namespace {

using test::Drive;
using test::LioRun;
using test::run_lio;
using test::Sensors;

/// Drives are expensive to simulate: one of each kind per process.
const Drive& hall_drive() {
  static const Drive drive =
      test::simulate(test::furnished_hall(), test::ellipse_drive(3.0, 6.0, 4.0, 1.3), 45.0, Sensors{}, 1);
  return drive;
}

const Drive& short_drive() {
  static const Drive drive =
      test::simulate(test::furnished_hall(), test::ellipse_drive(2.0, 6.0, 4.0, 1.3), 6.0, Sensors{}, 2);
  return drive;
}

FrontendConfig car_config() {
  FrontendConfig config;
  config.start = "moving";
  config.start_seconds = 0.2;
  config.max_range_m = 80.0;
  config.voxel_size_m = 0.5;
  config.match_radius_m = 1.5;
  config.max_centroid_offset = 0.5;
  config.max_surface_roughness = 0.1;
  config.max_mean_innovation = 0.3;
  config.max_scan_correction_m = 3.0;
  config.max_scan_velocity_corr = 3.0;
  config.map_window_m = 100.0;
  config.map_window_y = 30.0;
  config.iterations = 20;
  return config;
}

TEST(Lio, TracksAnL1ThroughAFurnishedHallWithTheDefaults) {
  const LioRun run = run_lio(FrontendConfig{}, hall_drive());
  EXPECT_TRUE(run.status.running);
  const int after_start = static_cast<int>(run.scans.size()) - test::count(run, ScanReason::kNotInitialised);
  EXPECT_GE(test::count(run, ScanReason::kApplied), after_start - 12);
  const double error = test::aligned_error(run, hall_drive());
  RecordProperty("ate_m", std::to_string(error));
  EXPECT_LT(error, 0.03);
  int degenerate = 0;
  for (const ScanResult& scan : run.scans) degenerate += scan.stats.degenerate_directions > 0 ? 1 : 0;
  RecordProperty("degenerate_scans", degenerate);
}

TEST(Lio, DriftsFarMoreWithoutScans) {
  FrontendConfig config;
  config.use_scan_matching = false;
  const LioRun run = run_lio(config, hall_drive());
  EXPECT_GT(test::count(run, ScanReason::kMatchingDisabled), 500);
  EXPECT_GT(test::aligned_error(run, hall_drive()), 1.0);
}

TEST(Lio, CovarianceOfVelocityIsHonest) {
  const LioRun run = run_lio(FrontendConfig{}, hall_drive());
  double nees = 0.0;
  int count = 0;
  for (const ScanResult& scan : run.scans) {
    if (!scan.stats.applied()) continue;
    const double t = test::drive_seconds(hall_drive(), scan.state.utime);
    const Eigen::Vector3d v =
        (hall_drive().truth(t + 1e-3).translation - hall_drive().truth(t - 1e-3).translation) / 2e-3;
    const Eigen::Vector3d error = v - scan.state.v_odom;
    nees += error.dot(scan.covariance.block<3, 3>(kVelocity, kVelocity).inverse() * error) / 3.0;
    ++count;
  }
  nees /= count;
  RecordProperty("velocity_nees_per_dof", std::to_string(nees));
  EXPECT_GT(nees, 0.2);
  EXPECT_LT(nees, 4.0);
}

TEST(Lio, ATurnTellsTheTiltOfTheStartFromAnAccelerometerBias) {
  const FrontendConfig config;
  const LioRun straight =
      run_lio(config, test::simulate(test::furnished_hall(), test::straight_drive(2.0, 1.0), 8.0, Sensors{}, 1));
  const LioRun turning = run_lio(config, hall_drive());
  const auto sigma_of_bias = [](const LioRun& run) {
    return std::sqrt(run.scans.back().covariance(kAccelBias, kAccelBias));
  };
  EXPECT_GT(sigma_of_bias(straight), 0.9 * config.accel_bias_sigma) << "nothing tells them apart";
  EXPECT_LT(sigma_of_bias(turning), 0.3 * config.accel_bias_sigma);

  const NavState& end = turning.scans.back().state;
  EXPECT_LT((end.accel_bias - Sensors{}.accel_bias).norm(), 3.0 * sigma_of_bias(turning));
  const Eigen::Quaterniond q_true = hall_drive().truth(test::drive_seconds(hall_drive(), end.utime)).rotation;
  const Eigen::Vector3d down = end.T_odom_body.rotation * (q_true.conjugate() * -Eigen::Vector3d::UnitY());
  const Eigen::Vector2d error = end.gravity_tilt - Eigen::Vector2d(down.x(), down.z());
  EXPECT_LT(error.norm(), 3.0 * sigma_of_bias(turning) / config.gravity_m) << "of " << end.gravity_tilt.norm();
}

TEST(Lio, CorridorLeavesItsAxisToTheImuAndSaysSoAboveTheThreshold) {
  const Drive drive = test::simulate(test::bare_corridor(), test::straight_drive(2.5, 1.0), 8.0, Sensors{}, 1);
  FrontendConfig config;
  config.degeneracy_threshold = 0.002;  // above what noise alone makes a bare wall look like
  config.degeneracy_signal_to_noise = 0.0;
  const LioRun run = run_lio(config, drive);
  int applied = 0;
  int named = 0;
  double across = 0.0;
  for (const ScanResult& scan : run.scans) {
    if (!scan.stats.applied()) continue;
    ++applied;
    named += scan.stats.degenerate_directions == 1 ? 1 : 0;
    across = std::max(across, std::abs(scan.state.T_odom_body.translation.x()));
  }
  EXPECT_GT(applied, 100);
  EXPECT_GT(named, applied * 95 / 100);
  EXPECT_LT(across, 0.25) << "the walls hold the sideways direction, up to the tilt of the start";
  const Matrix15d& P = run.scans.back().covariance;
  EXPECT_GT(P(5, 5), 20.0 * P(3, 3)) << "the axis of the corridor must not look observed";
}

/// [m] Largest error along Z.
double largest_error_ahead(const LioRun& run, const Drive& drive) {
  double largest = 0.0;
  for (const ScanResult& scan : run.scans) {
    if (!scan.has_state) continue;
    const Pose truth = drive.truth(test::drive_seconds(drive, scan.state.utime));
    largest = std::max(largest, std::abs((scan.state.T_odom_body.translation - truth.translation).z()));
  }
  return largest;
}

TEST(Lio, PassesThroughADoorInAThinWallWithoutAStep) {
  // The far face of the wall lies within the match radius of the face that the map knows.
  test::World rooms = test::furnished_hall();
  rooms.boxes = {{{rooms.room.lo.x(), rooms.room.lo.y(), -5.1}, {-0.6, rooms.room.hi.y(), -4.9}},
                 {{0.6, rooms.room.lo.y(), -5.1}, {rooms.room.hi.x(), rooms.room.hi.y(), -4.9}}};
  rooms.pillars.clear();
  const Drive drive = test::simulate(rooms, test::straight_drive(3.0, 0.7), 12.5, Sensors{}, 3);
  EXPECT_LT(largest_error_ahead(run_lio(test::tuned_config(), drive), drive), 0.05);
}

TEST(Lio, PassesThroughADoorWhereLittleButItsWallTellsTheWay) {
  // From within the door its wall is seen at a few degrees, from the far side at once.
  test::World rooms = test::furnished_hall();
  rooms.room.lo.z() = -25.0;
  rooms.boxes = {{{rooms.room.lo.x(), rooms.room.lo.y(), -5.1}, {-1.7, rooms.room.hi.y(), -4.9}},
                 {{1.7, rooms.room.lo.y(), -5.1}, {rooms.room.hi.x(), rooms.room.hi.y(), -4.9}}};
  rooms.pillars.clear();
  Sensors sensors;
  sensors.range_sigma = 0.02;
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    const Drive drive = test::simulate(rooms, test::straight_drive(3.0, 0.8), 12.5, sensors, seed);
    EXPECT_LT(largest_error_ahead(run_lio(test::tuned_config(), drive), drive), 0.1) << "seed " << seed;
  }
}

TEST(Lio, MovingStartAtTenMetresPerSecond) {
  Sensors sensors;
  sensors.car = true;
  sensors.imu_hz = 10.0;
  sensors.scan_hz = 10.0;
  sensors.max_range = 80.0;
  sensors.range_sigma = 0.02;
  sensors.range_grid = 0.002;
  sensors.gyro_density = 0.0005;
  sensors.accel_density = 0.005;
  const Drive drive = test::simulate(test::street(), test::straight_drive(0.0, 10.0), 5.0, sensors, 1);
  const LioRun run = run_lio(car_config(), drive);
  const auto first = std::ranges::find_if(run.scans, [](const ScanResult& scan) { return scan.stats.applied(); });
  ASSERT_NE(first, run.scans.end());
  EXPECT_LT((first->state.v_odom - Eigen::Vector3d(0.0, 0.0, -10.0)).norm(), 0.3) << "the first two scans tell it";
  const ScanResult& last = run.scans.back();
  EXPECT_GE(test::count(run, ScanReason::kApplied), 40);
  EXPECT_LT((last.state.v_odom - Eigen::Vector3d(0.0, 0.0, -10.0)).norm(), 0.2);
  EXPECT_LT(test::aligned_error(run, drive), 0.1);
  EXPECT_NE(run.status.text.find("started moving"), std::string::npos);
  for (const ScanResult& scan : run.scans) {
    if (!scan.keyframe) continue;
    EXPECT_GT(scan.keyframe->state.v_odom.norm(), 8.0) << "no keyframe before the velocity is known";
    EXPECT_TRUE(scan.keyframe->imu_complete) << "100 ms is this IMU's period, not a gap";
  }
}

TEST(Lio, AMovingStartCountsItsWayFromTheFirstScanAndNotFromTheFirstSample) {
  Sensors sensors;
  sensors.car = true;
  sensors.max_range = 80.0;
  Drive drive = test::simulate(test::street(), test::straight_drive(0.0, 10.0), 3.0, sensors, 2);
  const Utime late = drive.imu.front().utime + to_micros(1.2);
  std::erase_if(drive.scans, [&](const Scan& scan) { return scan.utime < late; });
  const LioRun run = run_lio(car_config(), drive);
  const auto first = std::ranges::find_if(run.scans, [](const ScanResult& scan) { return scan.stats.applied(); });
  ASSERT_NE(first, run.scans.end());
  EXPECT_LT(first - run.scans.begin(), 3) << "two scans, 50 ms apart, tell the velocity";
  EXPECT_LT((first->state.v_odom - Eigen::Vector3d(0.0, 0.0, -10.0)).norm(), 1.5);
}

void expect_same(const std::vector<ScanResult>& a, const std::vector<ScanResult>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].stats.scan_sequence, b[i].stats.scan_sequence);
    EXPECT_EQ(a[i].stats.reason, b[i].stats.reason);
    EXPECT_EQ(difference(a[i].state, b[i].state).norm(), 0.0) << i;
    EXPECT_EQ((a[i].covariance - b[i].covariance).norm(), 0.0) << i;
    EXPECT_EQ(a[i].keyframe.has_value(), b[i].keyframe.has_value());
  }
}

TEST(Lio, GivesTheSameResultsForAnyInterleavingOfTheStreams) {
  const LioRun prompt = run_lio(FrontendConfig{}, short_drive(), 0.0);
  const LioRun late = run_lio(FrontendConfig{}, short_drive(), 0.37);
  const LioRun early = run_lio(FrontendConfig{}, short_drive(), -0.2);
  const std::size_t common = std::min({prompt.scans.size(), late.scans.size(), early.scans.size()});
  ASSERT_GT(common, 100U);
  const auto cut = [common](const LioRun& run) {
    return std::vector<ScanResult>(run.scans.begin(), run.scans.begin() + static_cast<std::ptrdiff_t>(common));
  };
  expect_same(cut(prompt), cut(late));
  expect_same(cut(prompt), cut(early));
}

TEST(Lio, TwoRunsAndARunAfterResetAreIdentical) {
  const LioRun first = run_lio(FrontendConfig{}, short_drive());
  expect_same(first.scans, run_lio(FrontendConfig{}, short_drive()).scans);

  Lio lio(FrontendConfig{});
  for (int round = 0; round < 2; ++round) {
    std::vector<ScanResult> scans;
    std::size_t next = 0;
    for (const ImuSample& sample : short_drive().imu) {
      while (next < short_drive().scans.size() && short_drive().scans[next].end_utime() + 2000 <= sample.utime) {
        for (ScanResult& scan : lio.add_scan(short_drive().scans[next++])) scans.push_back(std::move(scan));
      }
      for (ScanResult& scan : lio.add_imu(sample).scans) scans.push_back(std::move(scan));
    }
    expect_same(first.scans, scans);
    EXPECT_EQ(scans.back().stats.session, round);
    lio.reset();
  }
}

TEST(Lio, PublishesAStateForEverySampleOnceStarted) {
  const LioRun run = run_lio(FrontendConfig{}, short_drive());
  ASSERT_GT(run.states.size(), 1000U);
  for (std::size_t i = 1; i < run.states.size(); ++i) EXPECT_EQ(run.states[i].utime - run.states[i - 1].utime, 4000);
}

TEST(Lio, BadImuSamplesLeaveTheResultBitIdentical) {
  const LioRun clean = run_lio(FrontendConfig{}, short_drive());
  Drive dirty = short_drive();
  ImuSample bad = dirty.imu[900];
  bad.utime += 1000;
  bad.gyro.y() = std::numeric_limits<double>::infinity();
  dirty.imu.insert(dirty.imu.begin() + 901, bad);
  bad.gyro.y() = 1e30;
  dirty.imu.insert(dirty.imu.begin() + 901, bad);
  dirty.imu.insert(dirty.imu.begin() + 901, dirty.imu[900]);
  expect_same(clean.scans, run_lio(FrontendConfig{}, dirty).scans);
}

TEST(Lio, BadScansAreRefusedWithAReason) {
  Drive drive = short_drive();
  Scan repeated = drive.scans[80];
  Scan endless = drive.scans[81];
  endless.duration_us = 600'000;
  Scan sparse = drive.scans[90];
  sparse.points.resize(20);
  for (ScanPoint& point : drive.scans[95].points) point.position.setConstant(std::nanf(""));
  drive.scans[90] = sparse;
  drive.scans.insert(drive.scans.begin() + 82, {repeated, endless});
  const LioRun run = run_lio(FrontendConfig{}, drive);
  EXPECT_EQ(test::count(run, ScanReason::kBadStamp), 2);
  EXPECT_EQ(test::count(run, ScanReason::kTooFewPoints), 2);
  EXPECT_LT(test::end_error(run, drive), 0.2);
}

TEST(Lio, SurvivesAnImuGapAndMarksTheKeyframe) {
  Drive drive = short_drive();
  drive.imu.erase(drive.imu.begin() + 1000, drive.imu.begin() + 1025);
  const LioRun run = run_lio(FrontendConfig{}, drive);
  EXPECT_LT(test::end_error(run, drive), 0.2);
  int incomplete = 0;
  for (const ScanResult& scan : run.scans) incomplete += scan.keyframe && !scan.keyframe->imu_complete ? 1 : 0;
  EXPECT_EQ(incomplete, 1);
}

TEST(Lio, ScansWithoutAnyImuAreBoundedAndNamed) {
  Lio lio(FrontendConfig{});
  std::vector<ScanResult> results;
  for (const Scan& scan : short_drive().scans) {
    for (ScanResult& result : lio.add_scan(scan)) results.push_back(std::move(result));
  }
  ASSERT_EQ(results.size(), short_drive().scans.size() - 40);
  for (const ScanResult& result : results) EXPECT_EQ(result.stats.reason, ScanReason::kNoImu);
}

TEST(Lio, AContradictingScanIsRolledBackAndHasNoVote) {
  // One scan is replaced by the view of a room whose walls stand elsewhere.
  Drive drive = short_drive();
  for (ScanPoint& point : drive.scans[100].points) point.position *= 1.03F;
  const LioRun clean = run_lio(FrontendConfig{}, short_drive());
  const LioRun run = run_lio(FrontendConfig{}, drive);
  const ScanResult& scan = run.scans[100];
  EXPECT_TRUE(is_contradiction(scan.stats.reason)) << text(scan.stats.reason);
  EXPECT_LT((scan.state.T_odom_body.translation - clean.scans[100].state.T_odom_body.translation).norm(), 0.01);
  EXPECT_TRUE(run.scans[101].stats.applied());
}

TEST(Lio, BeginsTheMapAnewWhenEverythingContradictsIt) {
  // From one scan on all ranges are 6 % too long: nothing fits the old map, but the new scans fit one another.
  Drive drive = short_drive();
  for (std::size_t i = 70; i < drive.scans.size(); ++i) {
    for (ScanPoint& point : drive.scans[i].points) point.position *= 1.06F;
  }
  const LioRun run = run_lio(FrontendConfig{}, drive);
  for (std::size_t i = 70; i < 85; ++i) EXPECT_TRUE(is_contradiction(run.scans[i].stats.reason)) << i;
  int applied = 0;
  for (std::size_t i = 100; i < run.scans.size(); ++i) applied += run.scans[i].stats.applied() ? 1 : 0;
  EXPECT_GT(applied, 10);
}

TEST(ScanStats, ReasonsEqualTheConstantsOfTheMessage) {
  std::ifstream file(IGNIS_CONFIG_DIR "/../lcmtypes/scan_stats_t.lcm");
  std::stringstream content;
  content << file.rdbuf();
  const std::string lcm = content.str();
  const std::vector<std::pair<std::string, ScanReason>> expected = {
      {"APPLIED", ScanReason::kApplied},
      {"NOT_INITIALISED", ScanReason::kNotInitialised},
      {"TOO_FEW_POINTS", ScanReason::kTooFewPoints},
      {"TOO_FEW_MATCHES", ScanReason::kTooFewMatches},
      {"INNOVATION_TOO_LARGE", ScanReason::kInnovationTooLarge},
      {"UNOBSERVABLE", ScanReason::kUnobservable},
      {"CORRECTION_TOO_LARGE", ScanReason::kCorrectionTooLarge},
      {"VELOCITY_CORRECTION_TOO_LARGE", ScanReason::kVelocityCorrectionTooLarge},
      {"MATCHING_DISABLED", ScanReason::kMatchingDisabled},
      {"MAP_EMPTY", ScanReason::kMapEmpty},
      {"BAD_STAMP", ScanReason::kBadStamp},
      {"NO_IMU", ScanReason::kNoImu},
      {"NUMERICAL_FAILURE", ScanReason::kNumericalFailure},
      {"TOO_OFTEN", ScanReason::kTooOften},
      {"SESSION_ENDED", ScanReason::kSessionEnded},
      {"BEHIND", ScanReason::kBehind}};
  for (const auto& [name, reason] : expected) {
    EXPECT_NE(lcm.find(" " + name + " = " + std::to_string(static_cast<int>(reason))), std::string::npos) << name;
    EXPECT_NE(text(reason), "unknown reason");
  }
}

}  // namespace
}  // namespace ignis
