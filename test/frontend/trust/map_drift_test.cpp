// SPDX-License-Identifier: Apache-2.0
#include "frontend/trust/map_drift.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <utility>
#include <vector>

#include "common/so3.h"

namespace ignis {
namespace {

const Pose kStart{so3::exp({0.1, -0.2, 0.05}), {1.0, 2.0, 3.0}};

Matrix6d published(const MapDrift& drift, const Pose& pose) { return drift.pose_covariance(pose); }

/// The first state, with gravity's tilt as uncertain as `sigma` says along x and z.
FilterState first_state(const Eigen::Vector2d& sigma) {
  FilterState state;
  state.nominal.T_odom_body = kStart;
  state.covariance.setZero();
  state.covariance.block<2, 2>(kGravityTilt, kGravityTilt) = sigma.cwiseAbs2().asDiagonal();
  return state;
}

TEST(MapDrift, AStartThatIsNotLevelTiltsAllThatFollows) {
  MapDrift drift(1.0);
  constexpr double kTilt = 0.01;
  drift.begin(first_state({kTilt, kTilt}));
  Pose far = kStart;
  far.translation.z() -= 20.0;
  const Matrix6d covariance = published(drift, far);
  EXPECT_NEAR(covariance(kPosition, kPosition), 0.0, 1e-12) << "the heading is a definition";
  EXPECT_NEAR(std::sqrt(covariance(kPosition + 1, kPosition + 1)), 20.0 * kTilt, 1e-9);
  EXPECT_NEAR(covariance(kPosition + 2, kPosition + 2), 0.0, 1e-12) << "a turn does not stretch the way";
  const Eigen::Matrix3d R = far.rotation.toRotationMatrix();
  const Eigen::Matrix3d attitude = R * covariance.topLeftCorner<3, 3>() * R.transpose();
  const Eigen::Matrix3d expected = Eigen::Vector3d(kTilt * kTilt, 0.0, kTilt * kTilt).asDiagonal();
  EXPECT_LT((attitude - expected).norm(), 1e-12);
}

TEST(MapDrift, CovarianceMatchesSampledTurnsAndShiftsOfTheMap) {
  const Eigen::Vector2d sigma(0.01, 0.02);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const Pose later{so3::exp({0.3, 1.2, -0.1}), {5.0, 1.0, -9.0}};
  Matrix6d sampled = Matrix6d::Zero();
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    NavState tilted;
    const double x = normal(random);
    const double z = normal(random);
    tilted.gravity_tilt = sigma.cwiseProduct(Eigen::Vector2d(x, z));
    // The first pose is off by the turn that makes gravity point down, and the whole map with it.
    Pose wrong = kStart;
    wrong.rotation =
        Eigen::Quaterniond::FromTwoVectors(tilted.gravity_direction(), -Eigen::Vector3d::UnitY()) * kStart.rotation;
    const Pose moved = wrong * (kStart.inverse() * later);
    Vector6d error;
    error << so3::log(later.rotation.conjugate() * moved.rotation), moved.translation - later.translation;
    sampled += error * error.transpose() / kSamples;
  }
  MapDrift drift(1.0);
  drift.begin(first_state(sigma));
  const Matrix6d expected = published(drift, later);
  EXPECT_LT((sampled - expected).norm(), 0.05 * expected.norm());
}

TEST(MapDrift, GrowsWithEachScanByThePosesVarianceOverTheAgeOfTheMap) {
  MapDrift drift(2.0);
  drift.begin(first_state(Eigen::Vector2d::Zero()));
  Matrix6d covariance = 1e-6 * Matrix6d::Identity();
  covariance(kPosition + 2, kPosition + 2) = 1e-2;  // not observed
  drift.add_scan(covariance, Matrix6d::Zero(), kStart, 10.0, {});
  EXPECT_NEAR(published(drift, kStart)(kPosition, kPosition), 2.0 * 1e-6 / 10.0, 1e-12);
  EXPECT_NEAR(published(drift, kStart)(kPosition + 2, kPosition + 2), 2.0 * 1e-2 / 10.0, 1e-9);
  EXPECT_NEAR(published(drift, kStart)(kAttitude, kAttitude), 2.0 * 1e-6 / 10.0, 1e-12);
  drift.add_scan(covariance, Matrix6d::Zero(), kStart, 0.0, {});
  EXPECT_NEAR(published(drift, kStart)(kPosition, kPosition), 2.0 * 1e-6 * 1.1, 1e-12) << "at least one scan old";
}

TEST(MapDrift, NoiseIsLeftBehindLessByAnOldMapAndDisagreementAsLongAsItsPlanesAreMet) {
  const Matrix6d some = 1e-6 * Matrix6d::Identity();
  const Matrix6d none = Matrix6d::Zero();
  const auto left_behind = [&](const Matrix6d& noise, const Matrix6d& disagreement, double age) {
    MapDrift drift(1.0);
    drift.begin(first_state(Eigen::Vector2d::Zero()));
    drift.add_scan(noise, disagreement, kStart, age, {});
    return published(drift, kStart)(kPosition, kPosition);
  };
  EXPECT_NEAR(left_behind(some, none, 100.0) / left_behind(some, none, 200.0), 4.0, 1e-9);
  EXPECT_NEAR(left_behind(none, some, 100.0) / left_behind(none, some, 200.0), 2.0, 1e-9);
  EXPECT_NEAR(left_behind(none, some, 100.0), 14.0 * 1e-6 / 100.0, 1e-12);
}

TEST(MapDrift, BendsByAllOfTheNoiseInAxesOfTheMapHoweverOldTheMapIs) {
  const MapDrift drift(2.0);
  Matrix6d covariance = Matrix6d::Identity();
  covariance.topLeftCorner<3, 3>() = Eigen::Vector3d(1e-6, 2e-6, 3e-6).asDiagonal();
  const Eigen::Matrix3d R = kStart.rotation.toRotationMatrix();
  const Eigen::Matrix3d expected = 2.0 / 200.0 * R * covariance.topLeftCorner<3, 3>() * R.transpose();
  EXPECT_LT((drift.bend(covariance, kStart, 200.0) - expected).norm(), 1e-15);
}

/// Published variance along Z of a drive that was known to 1 cm at scan 10, 1 m at scan 110 and 2 m at scan 210.
struct Drifted : ::testing::Test {
  Drifted() {
    drift.begin(first_state(Eigen::Vector2d::Zero()));
    drift.remember(10, 1e-4 * Eigen::Matrix3d::Identity(), kStart.translation, {});
    drift.remember(110, Eigen::Matrix3d::Identity(), kStart.translation, {});
    drift.remember(210, 4.0 * Eigen::Matrix3d::Identity(), kStart.translation, {});
  }
  [[nodiscard]] Eigen::Vector3d variances() const { return published(drift, kStart).diagonal().segment<3>(kPosition); }

  MapDrift drift{1.0};
  const std::array<Eigen::Vector3d, 1> along{Eigen::Vector3d::UnitZ()};
};

TEST_F(Drifted, TheNewestScanFarFromHereIsTheLastOneBeforeTheWayBack) {
  Eigen::Vector3d position = kStart.translation;
  EXPECT_EQ(drift.newest_beyond(0.5, position), -1);
  position.z() -= 2.0;
  drift.remember(220, 4.0 * Eigen::Matrix3d::Identity(), position, {});
  EXPECT_EQ(drift.newest_beyond(0.5, position), 210);
  EXPECT_EQ(drift.newest_beyond(0.5, kStart.translation), 220);
}

TEST_F(Drifted, APoseHeldByAPlaneIsKnownNoBetterThanWhenThePlaneWasMapped) {
  drift.hold_to(110.0, along, kStart);
  EXPECT_NEAR(variances().z(), 1.0, 1e-12);
  EXPECT_NEAR(variances().x(), 0.0, 1e-12) << "other directions are held by all planes";
}

TEST_F(Drifted, AnOldPlaneBringsBackWhatWasKnownThen) {
  drift.hold_to(9.0, along, kStart);
  EXPECT_NEAR(variances().z(), 1e-4, 1e-12);
}

TEST_F(Drifted, WhatIsKnownWorseAlreadyStays) {
  drift.hold_to(110.0, along, kStart);
  drift.hold_to(10.0, along, kStart);
  EXPECT_NEAR(variances().z(), 1.0, 1e-12);
}

TEST_F(Drifted, BetweenTwoRememberedScansTheLaterCounts) {
  drift.hold_to(111.0, along, kStart);
  EXPECT_NEAR(variances().z(), 4.0, 1e-12);
}

TEST_F(Drifted, APlaneOfTheNewestScansIsHeldToTheNewestThatIsRemembered) {
  drift.hold_to(500.0, along, kStart);
  EXPECT_NEAR(variances().z(), 4.0, 1e-12);
}

TEST_F(Drifted, PlanesAreSureSinceThePositionWasAsWellKnownAsNow) {
  const Eigen::Matrix3d now = 4.01 * Eigen::Matrix3d::Identity();
  EXPECT_EQ(drift.sure_since(now, kStart.translation, 3.0), 0) << "within three metres all of them";
  EXPECT_EQ(drift.sure_since(now, kStart.translation, 1.9), 110) << "what came between may be as vague as scan 10";
  EXPECT_EQ(drift.sure_since(now, kStart.translation, 0.15), 210);
  EXPECT_EQ(drift.sure_since(now, kStart.translation, 0.05), 211) << "none";
}

TEST_F(Drifted, WhereThePlaceIsDoubtfulNothingIsLearned) {
  const Eigen::Matrix3d before = Eigen::Vector3d(0.25, 0.25, 0.36).asDiagonal();
  const Eigen::Matrix3d in_map = 1e-4 * Eigen::Matrix3d::Identity();
  drift.doubt(before, along, kStart, in_map);
  EXPECT_NEAR(variances().z(), 0.36 - 1e-4, 1e-12) << "both make up what was known before";
  EXPECT_NEAR(variances().x(), 0.0, 1e-12) << "along other axes the scan counts";
}

TEST_F(Drifted, AScanThatDoesNotEnterTheMapPlacesNothing) {
  drift.remember(210, 9.0 * Eigen::Matrix3d::Identity(), kStart.translation, {});
  drift.hold_to(210.0, along, kStart);
  EXPECT_NEAR(variances().z(), 4.0, 1e-12);
}

TEST(MapDrift, KnowsToTheScanWhereAGapInTheDriveLies) {
  MapDrift drift(1.0);
  drift.begin(first_state(Eigen::Vector2d::Zero()));
  for (int scan = 1; scan <= 37; ++scan) {
    const double variance = scan < 37 ? 1e-4 : 1.0;  // metres come together without scans
    drift.remember(scan, variance * Eigen::Matrix3d::Identity(), kStart.translation, {});
  }
  EXPECT_EQ(drift.sure_since(1.1 * Eigen::Matrix3d::Identity(), kStart.translation, 0.5), 37);
  const std::array<Eigen::Vector3d, 1> along{Eigen::Vector3d::UnitZ()};
  drift.hold_to(36.0, along, kStart);
  EXPECT_NEAR(published(drift, kStart)(kPosition + 2, kPosition + 2), 1e-4, 1e-12) << "from before it";
  drift.hold_to(36.5, along, kStart);
  EXPECT_NEAR(published(drift, kStart)(kPosition + 2, kPosition + 2), 1.0, 1e-12) << "from behind it, in part";
}

TEST(MapDrift, WhatNoScanObservedIsCountedOnceItIsMeasuredAgain) {
  MapDrift drift(1.0);
  drift.begin(first_state(Eigen::Vector2d::Zero()));
  const std::array<Eigen::Vector3d, 1> along{Eigen::Vector3d::UnitZ()};
  Matrix6d in_map = 1e-6 * Matrix6d::Identity();
  double& along_variance = in_map(kPosition + 2, kPosition + 2);
  for (int scan = 1; scan <= 200; ++scan) {  // a corridor
    along_variance = 1e-4 * scan;
    drift.add_scan(in_map, Matrix6d::Zero(), kStart, 10.0, along);
    drift.remember(scan, (in_map + published(drift, kStart)).bottomRightCorner<3, 3>(), kStart.translation, along);
  }
  EXPECT_LT(published(drift, kStart)(kPosition + 2, kPosition + 2), 1e-9) << "the filter's own covariance says it";
  EXPECT_NEAR(published(drift, kStart)(kPosition, kPosition), 200 * 1e-7, 1e-9) << "as for any observed direction";

  along_variance = 1e-6;  // against an end wall that was mapped on the way
  const Eigen::Matrix3d position = in_map.bottomRightCorner<3, 3>();
  drift.hand_over(along, kStart, position);
  EXPECT_LT(published(drift, kStart)(kPosition + 2, kPosition + 2), 1e-9) << "not measured yet";
  drift.hand_over({}, kStart, position);
  EXPECT_NEAR(published(drift, kStart)(kPosition + 2, kPosition + 2), 200e-4 - 1e-6, 1e-9);
  EXPECT_NEAR(published(drift, kStart)(kPosition, kPosition), 200 * 1e-7, 1e-9);
}

TEST(MapDrift, ABlindDirectionThatTurnsHandsOverWhatItLeaves) {
  MapDrift drift(1.0);
  drift.begin(first_state(Eigen::Vector2d::Zero()));
  const std::array<Eigen::Vector3d, 1> before{Eigen::Vector3d::UnitZ()};
  const Eigen::Matrix3d position = Eigen::Vector3d(1e-6, 1e-6, 1.0).asDiagonal();
  drift.remember(1, position, kStart.translation, before);
  constexpr double kTurn = 0.1;
  const std::array<Eigen::Vector3d, 1> after{Eigen::Vector3d(std::sin(kTurn), 0.0, std::cos(kTurn))};
  const Eigen::Vector3d across(std::cos(kTurn), 0.0, -std::sin(kTurn));
  drift.hand_over(after, kStart, 1e-6 * Eigen::Matrix3d::Identity());
  const Eigen::Matrix3d shift = published(drift, kStart).bottomRightCorner<3, 3>();
  EXPECT_NEAR(std::sqrt(across.dot(shift * across)), std::sin(kTurn), 1e-3);
  EXPECT_NEAR(after[0].dot(shift * after[0]), 0.0, 1e-9);
}

TEST(MapDrift, TheTiltOfTheStartMakesNoOldPlaneDoubtful) {
  MapDrift drift(1.0);
  drift.begin(first_state({0.01, 0.01}));
  const auto position_covariance = [&](const Pose& pose) {
    return Eigen::Matrix3d(published(drift, pose).bottomRightCorner<3, 3>());
  };
  drift.remember(10, position_covariance(kStart), kStart.translation, {});
  Pose far = kStart;
  far.translation.z() -= 50.0;
  EXPECT_EQ(drift.sure_since(position_covariance(far), far.translation, 0.001), 0) << "it has turned both alike";
  const Eigen::Matrix3d vaguer = position_covariance(far) + 1e-4 * Eigen::Matrix3d::Identity();
  EXPECT_EQ(drift.sure_since(vaguer, far.translation, 0.009), 11);
}

TEST_F(Drifted, ANewMapForgetsThePlacesOfTheOld) {
  drift.remember(1, 0.25 * Eigen::Matrix3d::Identity(), kStart.translation, {});
  drift.hold_to(300.0, along, kStart);
  EXPECT_NEAR(variances().z(), 0.25, 1e-12);
}

TEST(MapDrift, RemembersAnHourWithoutGrowing) {
  MapDrift drift(1.0);
  drift.begin(first_state(Eigen::Vector2d::Zero()));
  constexpr int kHour = 72'000;
  for (int scan = 0; scan < kHour; ++scan)
    drift.remember(scan, scan * Eigen::Matrix3d::Identity(), kStart.translation, {});
  for (const int then : {kHour / 100, kHour / 10, kHour - 100}) {
    const double growth = std::sqrt(static_cast<double>(kHour - then));
    const int since = drift.sure_since(kHour * Eigen::Matrix3d::Identity(), kStart.translation, growth);
    EXPECT_NEAR(since, then, 0.05 * (kHour - then) + 10);
  }
  std::vector<std::byte> bytes;
  ByteWriter writer(bytes);
  transfer(writer, std::as_const(drift));
  EXPECT_LT(bytes.size(), 40'000U);
}

}  // namespace
}  // namespace ignis
