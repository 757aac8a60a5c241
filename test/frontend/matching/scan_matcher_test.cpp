// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/scan_matcher.h"

#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "frontend/standing_sensor.h"

namespace ignis {
namespace {

class ScanMatcherTest : public ::testing::Test {
 protected:
  ScanMatcherTest() { predicted_.covariance = 1e-4 * ErrorCovariance::Identity(); }

  [[nodiscard]] MatchResult match() const {
    return ScanMatcher(config_).match(predicted_, predicted_.nominal.T_odom_body, standing_.newest, standing_.map);
  }

  test::StandingSensor standing_;
  FrontendConfig config_ = standing_.config;
  FilterState predicted_;
};

TEST_F(ScanMatcherTest, AppliesAScanThatFits) { EXPECT_EQ(match().stats.reason, ScanReason::kApplied); }

TEST_F(ScanMatcherTest, SaysSoWhenNoDirectionIsObserved) {
  config_.degeneracy_signal_to_noise = 1000.0;
  config_.degeneracy_threshold = 0.3;
  const MatchResult result = match();
  EXPECT_EQ(result.stats.reason, ScanReason::kUnobservable);
  EXPECT_EQ(result.stats.degenerate_directions, 6);
  EXPECT_EQ(result.filter.covariance, predicted_.covariance) << "the prediction goes on as it is";
}

TEST_F(ScanMatcherTest, ACovarianceThatIsNoNumberIsANumericalFailureAndChangesNothing) {
  predicted_.covariance(kVelocity, kVelocity) = std::numeric_limits<double>::quiet_NaN();
  const MatchResult result = match();
  EXPECT_EQ(result.stats.reason, ScanReason::kNumericalFailure);
  EXPECT_EQ(result.filter.nominal.T_odom_body.translation, predicted_.nominal.T_odom_body.translation);
  EXPECT_TRUE(result.information_body.isZero());
}

TEST_F(ScanMatcherTest, AStepToADoubtfulPlaceSaysNothingOfTheVelocityThere) {
  // After some seconds of dead reckoning, position and velocity are off alike.
  for (int k = 0; k < 3; ++k) {
    predicted_.covariance(kPosition + k, kPosition + k) = 0.01;
    predicted_.covariance(kVelocity + k, kVelocity + k) = 0.01;
    predicted_.covariance(kPosition + k, kVelocity + k) = 0.009;
    predicted_.covariance(kVelocity + k, kPosition + k) = 0.009;
  }
  predicted_.nominal.T_odom_body.translation = {0.03, 0.0, 0.03};
  const std::array<Eigen::Vector3d, 1> doubtful{Eigen::Vector3d::UnitZ()};
  const MatchResult result = ScanMatcher(config_).match(predicted_, predicted_.nominal.T_odom_body, standing_.newest,
                                                        standing_.map, {.doubtful = doubtful});
  ASSERT_TRUE(result.stats.applied());
  EXPECT_LT(result.filter.nominal.T_odom_body.translation.norm(), 0.01) << "the position is corrected";
  EXPECT_NEAR(result.filter.nominal.v_odom.z(), 0.0, 1e-9);
  EXPECT_NEAR(result.filter.covariance(kVelocity + 2, kVelocity + 2), 0.01, 1e-6);
  EXPECT_LT(result.filter.nominal.v_odom.x(), -0.02) << "the other axis as ever";
  EXPECT_LT(result.filter.covariance(kVelocity, kVelocity), 0.005);
}

/// A standing sensor 8 m from the end of a corridor whose axis the scan as a whole is held to say nothing about.
class CorridorEnd : public ::testing::Test {
 protected:
  CorridorEnd() {
    test::World world = test::bare_corridor();
    world.room.lo.z() = -8.0;
    const test::Drive drive = test::simulate(world, test::straight_drive(10.0, 0.0), 3.0, test::Sensors{}, 3);
    for (std::size_t i = 0; i < 58; ++i) {
      std::vector<Eigen::Vector3f> points;
      for (const ScanPoint& point : drive.scans[i].points) points.push_back(point.position);
      if (i < 40) {
        map_.insert(points, Pose(), true);
      } else {
        scans_.push_back(points);
      }
    }
    config_.degeneracy_signal_to_noise = 8.0;
    predicted_.covariance = 1e-4 * ErrorCovariance::Identity();
    predicted_.nominal.T_odom_body.translation.z() = 0.02;
  }

  [[nodiscard]] MatchResult match(MapScans salient = {}) const {
    ScanMatcher matcher(config_);
    MatchResult result;
    for (const auto& scan : scans_) {
      result = matcher.match(predicted_, predicted_.nominal.T_odom_body, scan, map_, {.salient = salient});
    }
    return result;
  }

  FrontendConfig config_ = test::tuned_config();
  LocalMap map_{config_};
  std::vector<std::vector<Eigen::Vector3f>> scans_;
  FilterState predicted_;
};

TEST_F(CorridorEnd, HoldsTheAxisByItsPointsAlone) {
  const MatchResult with = match();
  ASSERT_TRUE(with.stats.applied());
  EXPECT_GE(with.salient.constraints.count, 3);
  EXPECT_EQ(with.stats.degenerate_directions, 0);
  EXPECT_LT(std::abs(with.filter.nominal.T_odom_body.translation.z()), 0.01);
  const Eigen::Matrix3d information = with.salient.constraints.information.bottomRightCorner<3, 3>();
  EXPECT_GT(information(2, 2), 1e3);
  EXPECT_LT(information(0, 0) + information(1, 1), 0.01 * information(2, 2)) << "along the blind direction only";
  EXPECT_GT(with.salient.mean_scan, 1.0);
  EXPECT_LE(with.salient.mean_scan, map_.scans());
}

TEST_F(CorridorEnd, IsLeftOutWhenItWasMappedBeforeThePoseCouldMoveAgainstIt) {
  const MatchResult without = match({.first = map_.scans() + 1});
  EXPECT_EQ(without.salient.constraints.count, 0);
  EXPECT_EQ(without.stats.degenerate_directions, 1);
}

TEST_F(CorridorEnd, IsLeftOutWhenItWasMappedFromNearby) {
  const MatchResult without = match({.last = -1});
  EXPECT_EQ(without.salient.constraints.count, 0);
  EXPECT_EQ(without.stats.degenerate_directions, 1);
}

TEST_F(CorridorEnd, IsTakenForChanceBelowTheShareThatIsAskedFor) {
  config_.salient_share = 0.5;
  EXPECT_EQ(match().salient.constraints.count, 0);
}

TEST_F(CorridorEnd, ThatContradictsItselfIsNoDisagreementAboutAnAxisThatIsNotObserved) {
  config_.degeneracy_signal_to_noise = 100.0;
  for (std::vector<Eigen::Vector3f>& scan : scans_) {
    float off = 0.14F;
    for (Eigen::Vector3f& point : scan) {
      if (point.z() < -7.0F) point.z() += std::exchange(off, -off);
    }
  }
  const MatchResult result = match({.first = map_.scans() + 1});
  ASSERT_TRUE(result.stats.applied());
  EXPECT_EQ(result.stats.degenerate_directions, 1);
  EXPECT_LT(result.disagreement(kPosition + 2, kPosition + 2), 1e-9);
}

/// A floor of squares of a metre, every other one of which, or each, is rough and was mapped too high.
struct Patches {
  double smooth_plane_m = 0.005;
  double enough_smooth_planes = 0.0;
  float too_high = 0.03F;  ///< [m]
  float noise = 0.0F;      ///< [m] of the points that are matched with it, up and down in turn
  bool all_rough = false;
  bool walls = false;  ///< smooth ones around it; else nothing holds a shift along the floor
  double range_noise_m = 0.0;
};

/// Calls visit(x, z, i, k) for a grid of 5 cm over 4 m x 4 m.
void for_each_point_of_a_floor(auto&& visit) {
  for (int i = -40; i < 40; ++i) {
    const float x = 0.05F * (static_cast<float>(i) + 0.5F);
    for (int k = -40; k < 40; ++k) visit(x, 0.05F * (static_cast<float>(k) + 0.5F), i, k);
  }
}

/// What a standing sensor makes of points that it sees of what it has mapped in forty scans.
MatchResult match_at_rest(const FrontendConfig& config, std::span<const Eigen::Vector3f> mapped,
                          std::span<const Eigen::Vector3f> seen, double prior_variance) {
  LocalMap map(config);
  for (int scan = 0; scan < 40; ++scan) map.insert(mapped, Pose(), true);
  FilterState predicted;
  predicted.covariance = prior_variance * ErrorCovariance::Identity();
  MatchResult result = ScanMatcher(config).match(predicted, Pose(), seen, map);
  EXPECT_TRUE(result.stats.applied());
  return result;
}

double height(const MatchResult& result) { return result.filter.nominal.T_odom_body.translation.y(); }

/// Four walls around the floor, two metres high.
void add_walls(std::vector<Eigen::Vector3f>& mapped, std::vector<Eigen::Vector3f>& seen) {
  for_each_point_of_a_floor([&](float along, float up, int, int) {
    if (up < -1.0F || up > 1.0F) return;
    for (const float away : {-2.05F, 2.05F}) {
      for (const Eigen::Vector3f& point : {Eigen::Vector3f(away, up, along), Eigen::Vector3f(along, up, away)}) {
        mapped.push_back(point);
        seen.push_back(point);
      }
    }
  });
}

/// What a standing sensor a metre above the patches makes of them.
MatchResult match_over(const Patches& patches) {
  std::vector<Eigen::Vector3f> mapped;
  std::vector<Eigen::Vector3f> seen;
  for_each_point_of_a_floor([&](float x, float z, int i, int k) {
    const bool rough =
        patches.all_rough || (static_cast<int>(std::floor(x)) + static_cast<int>(std::floor(z))) % 2 != 0;
    const bool high = (static_cast<int>(std::floor(x / 0.1F)) + static_cast<int>(std::floor(z / 0.1F))) % 2 != 0;
    mapped.emplace_back(x, rough ? patches.too_high + (high ? -0.98F : -1.02F) : -1.0F, z);
    seen.emplace_back(x, -1.0F + ((i + k) % 2 != 0 ? patches.noise : -patches.noise), z);
  });
  if (patches.walls) add_walls(mapped, seen);
  FrontendConfig config = test::tuned_config();
  config.smooth_plane_m = patches.smooth_plane_m;
  config.enough_smooth_planes = patches.enough_smooth_planes;
  config.range_noise_m = patches.range_noise_m;
  return match_at_rest(config, mapped, seen, 1e-4);
}

TEST(RoughPlanes, CountForLittleWhereThereAreSmoothOnes) {
  const double all_alike = height(match_over({.smooth_plane_m = 0.0}));
  EXPECT_GT(all_alike, 0.005);
  EXPECT_LT(std::abs(height(match_over({}))), 0.3 * all_alike);
}

TEST(RoughPlanes, CountForNextToNothingWhereSmoothOnesSuffice) {
  const double by_smoothness = height(match_over({.smooth_plane_m = 0.013, .walls = true}));
  EXPECT_GT(by_smoothness, 0.003);
  const Patches strict{.smooth_plane_m = 0.013, .enough_smooth_planes = 6.0, .walls = true};
  EXPECT_LT(std::abs(height(match_over(strict))), 0.3 * by_smoothness);
}

TEST(RoughPlanes, AreHeardWhereSmoothOnesLeaveADirectionOpen) {
  const double by_smoothness = height(match_over({.smooth_plane_m = 0.013}));
  const double needed = height(match_over({.smooth_plane_m = 0.013, .enough_smooth_planes = 6.0}));
  EXPECT_GT(needed, 0.9 * by_smoothness);
}

TEST(RoughPlanes, AreHeardWhereTheyAreAllThatFacesTheWay) {
  const Patches floor{.smooth_plane_m = 0.005, .all_rough = true, .walls = true};
  const double by_smoothness = height(match_over(floor));
  EXPECT_GT(by_smoothness, 0.01);
  Patches strict = floor;
  strict.enough_smooth_planes = 6.0;
  EXPECT_GT(height(match_over(strict)), 0.9 * by_smoothness);
}

TEST(RoughPlanes, AreNotRoughWhereNoiseOfThePointsExplainsIt) {
  const Patches floor{.smooth_plane_m = 0.013, .enough_smooth_planes = 6.0, .walls = true};
  Patches noisy = floor;
  noisy.range_noise_m = 0.3;  // a voxel is the mean of many
  EXPECT_GT(height(match_over(noisy)), 5.0 * std::abs(height(match_over(floor))));
}

double information_on_height(const MatchResult& result) { return result.information_body(4, 4); }

TEST(RoughPlanes, ThatNoiseExplainsDoNotPassForCertain) {
  const Patches alike{.smooth_plane_m = 0.0, .too_high = 0.0F, .noise = 0.05F, .all_rough = true, .walls = true};
  Patches explained = alike;
  explained.smooth_plane_m = 0.013;
  explained.enough_smooth_planes = 6.0;
  explained.range_noise_m = 1.0;
  // Were they counted as off by a rough one's share of what they are off by, it would be four times as much.
  EXPECT_LT(information_on_height(match_over(explained)), 2.0 * information_on_height(match_over(alike)));
}

TEST(RoughPlanes, DoNotMakeTheSmoothOnesPassForNoisy) {
  const double where_they_fit = information_on_height(match_over({.too_high = 0.0F, .noise = 0.02F}));
  const double where_they_do_not = information_on_height(match_over({.too_high = 0.03F, .noise = 0.02F}));
  EXPECT_GT(where_they_do_not, 0.7 * where_they_fit);
}

/// How much too high a standing sensor takes itself to be above strips of floor, each a voxel wide and every other one
/// 4 cm higher, when it sees the lower ones alone: to each neighbourhood they are one rough plane halfway up.
double height_over_strips(double smooth_plane_m) {
  std::vector<Eigen::Vector3f> mapped;
  std::vector<Eigen::Vector3f> seen;
  for_each_point_of_a_floor([&](float x, float z, int, int) {
    const bool low = static_cast<int>(std::floor(x / 0.2F)) % 2 == 0;
    mapped.emplace_back(x, low ? -1.0F : -0.96F, z);
    if (low) seen.push_back(mapped.back());
  });
  FrontendConfig config = test::tuned_config();
  config.smooth_plane_m = smooth_plane_m;
  config.enough_smooth_planes = 0.0;
  return height(match_at_rest(config, mapped, seen, 1e-2));
}

TEST(RoughPlanes, LieWhereTheVoxelOfThePointSaysAndNotWhereItsNeighboursDo) {
  const double by_all_neighbours = height_over_strips(0.0);
  EXPECT_GT(by_all_neighbours, 0.008);
  EXPECT_LT(std::abs(height_over_strips(0.005)), 0.4 * by_all_neighbours);
}

/// A floor and four walls, of which the two across X are seen closer to each other than they were mapped, by twice
/// `squeeze` [m].
MatchResult match_between_walls_closer_by(float squeeze) {
  std::vector<Eigen::Vector3f> mapped;
  std::vector<Eigen::Vector3f> seen;
  for_each_point_of_a_floor([&](float x, float z, int, int) { mapped.emplace_back(x, -1.0F, z); });
  seen = mapped;
  add_walls(mapped, seen);
  for (Eigen::Vector3f& point : seen) {
    if (std::abs(point.x()) > 2.0F) point.x() -= std::copysign(squeeze, point.x());
  }
  return match_at_rest(test::tuned_config(), mapped, seen, 1e-4);
}

TEST(Disagreement, IsAlongTheAxisAcrossWhichTwoWallsContradictEachOther) {
  const Vector6d none = match_between_walls_closer_by(0.0F).disagreement.diagonal();
  const Vector6d squeezed = match_between_walls_closer_by(0.15F).disagreement.diagonal();
  EXPECT_EQ(none.maxCoeff(), 0.0);
  EXPECT_GT(squeezed[kPosition], 1e-7);
  EXPECT_LT(squeezed[kPosition + 1] + squeezed[kPosition + 2], 0.01 * squeezed[kPosition]);
}

}  // namespace
}  // namespace ignis
