// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_matcher.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "backend/synthetic_drive.h"
#include "common/so3.h"

namespace ignis {
namespace {

LoopMatch match_cloud(const std::vector<CloudPoint>& cloud, const std::vector<CloudPoint>& map, const Pose& guess,
                      const LoopMatcherConfig& config, const LoopGates& gates) {
  LoopSource source(cloud, config);
  const CloudInMap placed{map, Pose()};
  return match_loop(source, std::span(&placed, 1), guess, config, gates);
}

using testing::hall_cloud;

/// Two views of the hall half a metre apart.
struct TwoViews {
  Pose T_world_a{so3::exp({0.0, 0.3, 0.0}), {-1.0, 0.0, -2.0}};
  Pose T_world_b{so3::exp({0.0, 0.5, 0.0}), {-1.3, 0.0, -2.4}};
  Pose T_a_b = T_world_a.inverse() * T_world_b;
  std::vector<CloudPoint> map = hall_cloud(T_world_a, 8000, 1);
  std::vector<CloudPoint> source = hall_cloud(T_world_b, 4000, 2);
};

Vector6d offset(double yaw, double x, double y, double z) {
  Vector6d delta;
  delta << 0.01, yaw, -0.01, x, y, z;
  return delta;
}

TEST(LoopMatcher, FindsThePoseFromAnOffsetCandidate) {
  const TwoViews views;
  for (const Vector6d& delta :
       {offset(0.0, 0.0, 0.0, 0.0), offset(0.12, 0.6, 0.1, -0.5), offset(-0.1, -0.7, -0.1, 0.6)}) {
    const LoopMatch match =
        match_cloud(views.source, views.map, perturbed_in_body(views.T_a_b, delta), LoopMatcherConfig(), LoopGates());
    ASSERT_TRUE(match.verified()) << match.reason_text;
    const Vector6d error = body_difference(views.T_a_b, match.T_map_source);
    EXPECT_LT(error.head<3>().norm(), 0.002);
    EXPECT_LT(error.tail<3>().norm(), 0.015);
    EXPECT_EQ(match.directions, 6);
    EXPECT_NEAR(match.correction_m, delta.tail<3>().norm(), 0.02);
    EXPECT_NEAR(match.correction_rad, delta.head<3>().norm(), 0.003);
  }
}

TEST(LoopMatcher, ClaimsAnInformationThatItsErrorsBear) {
  // Errors over independent clouds, whitened with the claimed information after the configured inflation of 5, must not
  // be larger than a six-dimensional unit Gaussian makes them.
  double sum = 0.0;
  constexpr int kRuns = 12;
  for (unsigned run = 0; run < kRuns; ++run) {
    TwoViews views;
    views.map = hall_cloud(views.T_world_a, 8000, 100 + run);
    views.source = hall_cloud(views.T_world_b, 4000, 200 + run);
    const LoopMatch match = match_cloud(views.source, views.map, views.T_a_b, LoopMatcherConfig(), LoopGates());
    ASSERT_TRUE(match.verified()) << match.reason_text;
    const Vector6d error = body_difference(match.T_map_source, views.T_a_b);
    sum += error.dot(match.information * error) / 5.0;
  }
  EXPECT_LT(sum / kRuns, 8.0);
  EXPECT_GT(sum / kRuns, 0.05);
}

TEST(LoopMatcher, RefusesWrongPlaces) {
  // The whole hall, on a grid, told to be where the vehicle is not. Every place has the same floor.
  const TwoViews views;
  int places = 0;
  int verified = 0;
  for (double x = -25.0; x < 5.0; x += 6.0) {
    for (double z = -16.0; z < 20.0; z += 6.0) {
      const Pose T_world_elsewhere{so3::exp({0.0, 0.1 * x, 0.0}), {x, 0.0, z}};
      const Vector6d away = body_difference(views.T_world_b, T_world_elsewhere);
      if (away.head<3>().norm() < 0.8 && away.tail<3>().norm() < 3.0) continue;
      ++places;
      const std::vector<CloudPoint> elsewhere = hall_cloud(T_world_elsewhere, 4000, 3);
      if (match_cloud(elsewhere, views.map, views.T_a_b, LoopMatcherConfig(), LoopGates()).verified()) ++verified;
    }
  }
  EXPECT_GE(places, 28);
  EXPECT_EQ(verified, 0);
}

TEST(LoopMatcher, AppliesEachGate) {
  const TwoViews views;
  const Pose guess = perturbed_in_body(views.T_a_b, offset(0.0, 0.5, 0.0, 0.0));
  const auto reason_with = [&](const LoopMatcherConfig& config, const LoopGates& gates) {
    return match_cloud(views.source, views.map, guess, config, gates).reason;
  };
  LoopGates gates;
  gates.loop_match_min_frac = 0.999;
  EXPECT_EQ(reason_with({}, gates), LoopReason::kTooFewMatched);
  LoopMatcherConfig walls;
  walls.min_wall_fraction = 1.0;
  EXPECT_EQ(reason_with(walls, {}), LoopReason::kTooFewMatched);
  LoopMatcherConfig overlap;
  overlap.min_overlap = 1.0;
  EXPECT_EQ(reason_with(overlap, {}), LoopReason::kTooLittleOverlap);
  gates = {};
  gates.loop_max_mean_innovation = 0.004;
  EXPECT_EQ(reason_with({}, gates), LoopReason::kResidualTooLarge);
  gates = {};
  gates.loop_max_correction_m = 0.4;
  EXPECT_EQ(reason_with({}, gates), LoopReason::kCorrectionTooLarge);
  LoopMatcherConfig config;
  config.max_iterations = 2;
  config.first_radius_m = config.last_radius_m = 1.0;
  gates = {};
  gates.loop_max_mean_innovation = 1.0;
  EXPECT_EQ(reason_with(config, gates), LoopReason::kDidNotConverge);
}

/// Points on a rectangle, in rows 12 cm apart.
void add_wall(std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& corner, const Eigen::Vector3d& along,
              const Eigen::Vector3d& up) {
  constexpr double kStep = 0.12;
  for (double u = 0.0; u < along.norm(); u += kStep) {
    for (double v = 0.0; v < up.norm(); v += kStep)
      points.push_back(corner + u * along.normalized() + v * up.normalized());
  }
}

/// A room with a floor and four walls, and in the body's view a partition wall or not.
std::vector<Eigen::Vector3d> room(bool partition) {
  std::vector<Eigen::Vector3d> points;
  const Eigen::Vector3d up(0.0, 2.5, 0.0);
  add_wall(points, {-5.0, -0.5, -6.0}, {10.0, 0.0, 0.0}, {0.0, 0.0, 12.0});
  add_wall(points, {-5.0, -0.5, -6.0}, {10.0, 0.0, 0.0}, up);
  add_wall(points, {-5.0, -0.5, 6.0}, {10.0, 0.0, 0.0}, up);
  add_wall(points, {-5.0, -0.5, -6.0}, {0.0, 0.0, 12.0}, up);
  add_wall(points, {5.0, -0.5, -6.0}, {0.0, 0.0, 12.0}, up);
  if (partition) {
    add_wall(points, {-4.0, -0.5, -2.5}, {8.0, 0.0, 0.0}, up);
    add_wall(points, {-4.0, -0.5, 2.5}, {8.0, 0.0, 0.0}, up);
    add_wall(points, {-3.0, -0.5, -2.0}, {0.0, 0.0, 4.0}, up);
    add_wall(points, {3.0, -0.5, -2.0}, {0.0, 0.0, 4.0}, up);
  }
  return points;
}

std::vector<CloudPoint> cloud_of(const std::vector<Eigen::Vector3d>& points) {
  std::vector<CloudPoint> cloud;
  for (const Eigen::Vector3d& point : points) cloud.push_back({point.cast<float>(), 0.0F});
  return cloud;
}

TEST(LoopMatcher, SeesThatTheCandidateHasWallsWhichAreNotHere) {
  // An empty room fits wholly into a room of the same size with partitions; only the other way round they differ.
  const std::vector<CloudPoint> empty = cloud_of(room(false));
  const LoopMatch same = match_cloud(empty, empty, Pose(), LoopMatcherConfig(), LoopGates());
  EXPECT_TRUE(same.verified()) << same.reason_text;
  EXPECT_GT(same.overlap, 0.95);
  const LoopMatch other = match_cloud(empty, cloud_of(room(true)), Pose(), LoopMatcherConfig(), LoopGates());
  EXPECT_GT(other.matched_fraction, 0.7);
  EXPECT_GT(other.wall_fraction, 0.7);
  EXPECT_LT(other.overlap, 0.8);
  LoopMatcherConfig strict;
  strict.min_overlap = 0.85;
  EXPECT_EQ(match_cloud(empty, cloud_of(room(true)), Pose(), strict, LoopGates()).reason,
            LoopReason::kTooLittleOverlap);
  EXPECT_TRUE(match_cloud(empty, empty, Pose(), strict, LoopGates()).verified());
}

TEST(LoopMatcher, CountsAPlaneByHowSmoothItIs) {
  // One wall is a hedge, 5 cm rough, that shows itself 8 cm farther away on the second visit; its opposite is plaster.
  const auto visit = [](double farther, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::vector<Eigen::Vector3d> points = room(false);
    for (Eigen::Vector3d& p : points) {
      if (p.x() > 4.99) p.x() += farther + 0.05 * normal(random);
    }
    return cloud_of(points);
  };
  const auto error = [&](double smooth_plane_m) {
    LoopMatcherConfig config;
    config.smooth_plane_m = smooth_plane_m;
    const LoopMatch match = match_cloud(visit(0.08, 1), visit(0.0, 2), Pose(), config, LoopGates());
    EXPECT_TRUE(match.verified()) << match.reason_text;
    return std::abs(match.T_map_source.translation.x());
  };
  EXPECT_GT(error(0.0), 0.015);
  EXPECT_LT(error(0.01), 0.4 * error(0.0));
}

TEST(LoopMatcher, DoesNotAskForWhatIsHidden) {
  // The candidate's outer walls stand behind the partitions that surround the body.
  const std::vector<Eigen::Vector3d> all = room(true);
  std::vector<Eigen::Vector3d> inside;
  for (const Eigen::Vector3d& p : all) {
    if (std::abs(p.x()) < 4.1 && std::abs(p.z()) < 2.6) inside.push_back(p);
  }
  EXPECT_GT(match_cloud(cloud_of(inside), cloud_of(all), Pose(), LoopMatcherConfig(), LoopGates()).overlap, 0.9);
}

TEST(LoopMatcher, LeavesTheDirectionOfACorridorFree) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> along(-12.0, 12.0);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<CloudPoint> corridor;
  for (int i = 0; i < 6000; ++i) {
    const double z = along(random);
    const double s = unit(random);
    const Eigen::Vector3d faces[] = {{-1.5, 3.0 * s - 0.5, z}, {1.5, 3.0 * s - 0.5, z}, {3.0 * s - 1.5, -0.5, z}};
    corridor.push_back({faces[i % 3].cast<float>(), 0.0F});
  }
  std::vector<CloudPoint> source;
  for (const CloudPoint& point : corridor) {
    if (std::abs(point.position.z()) < 8.0F) source.push_back(point);
  }
  Pose guess;
  guess.translation = {0.3, 0.1, 0.7};
  const LoopMatch match = match_cloud(source, corridor, guess, LoopMatcherConfig(), LoopGates());
  ASSERT_TRUE(match.verified()) << match.reason_text;
  EXPECT_EQ(match.directions, 5);
  EXPECT_NEAR(match.T_map_source.translation.x(), 0.0, 0.02);
  EXPECT_NEAR(match.T_map_source.translation.y(), 0.0, 0.02);
  EXPECT_NEAR(match.T_map_source.translation.z(), 0.7, 0.02);
  EXPECT_LT(match.information(5, 5), 1e-3 * match.information(3, 3));
}

TEST(LoopMatcher, SaysDegenerateWhenThereIsNothingButFloor) {
  std::vector<CloudPoint> floor;
  for (int x = -20; x <= 20; ++x) {
    for (int z = -20; z <= 20; ++z) {
      floor.push_back({{0.2F * static_cast<float>(x), -0.5F, 0.2F * static_cast<float>(z)}, 0.0F});
    }
  }
  EXPECT_EQ(match_cloud(floor, floor, Pose(), LoopMatcherConfig(), LoopGates()).reason, LoopReason::kDegenerate);
}

TEST(LoopMatcher, RefusesEmptyAndNonFiniteClouds) {
  const TwoViews views;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<CloudPoint> broken(10, CloudPoint{{nan, 0.0F, 0.0F}, 0.0F});
  EXPECT_EQ(match_cloud({}, views.map, Pose(), {}, {}).reason, LoopReason::kTooFewMatched);
  EXPECT_EQ(match_cloud(broken, views.map, Pose(), {}, {}).reason, LoopReason::kTooFewMatched);
  EXPECT_EQ(match_cloud(views.source, {}, Pose(), {}, {}).reason, LoopReason::kTooFewMatched);
}

}  // namespace
}  // namespace ignis
