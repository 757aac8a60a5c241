// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_detector.h"

#include <gtest/gtest.h>

#include <numbers>

#include "common/frames.h"

namespace ignis {
namespace {

KeyframePose at(std::int32_t id, double x, double y, double z, double yaw = 0.0) {
  return {id, {frames::from_yaw_pitch_roll({yaw, 0.0, 0.0}), {x, y, z}}};
}

TEST(LoopDetector, GatesTheHorizontalDistanceAndIgnoresHeight) {
  const LoopGates gates;
  const KeyframePose current = at(50, 0.0, 0.0, 0.0);
  EXPECT_TRUE(is_loop_candidate(current, at(1, 7.99, 0.0, 0.0), gates));
  EXPECT_FALSE(is_loop_candidate(current, at(1, 8.01, 0.0, 0.0), gates));
  EXPECT_TRUE(is_loop_candidate(current, at(1, 0.0, 0.0, -7.99), gates));
  EXPECT_FALSE(is_loop_candidate(current, at(1, 6.0, 0.0, 6.0), gates));
  EXPECT_TRUE(is_loop_candidate(current, at(1, 0.0, 30.0, 0.0), gates));
}

TEST(LoopDetector, GatesTheHeadingAcrossTheTurnOver) {
  const LoopGates gates;
  const double quarter = std::numbers::pi / 2.0;
  EXPECT_TRUE(is_loop_candidate(at(50, 0, 0, 0, 0.1), at(1, 1, 0, 0, 0.1 + quarter - 0.01), gates));
  EXPECT_FALSE(is_loop_candidate(at(50, 0, 0, 0, 0.1), at(1, 1, 0, 0, 0.1 + quarter + 0.01), gates));
  EXPECT_TRUE(is_loop_candidate(at(50, 0, 0, 0, 3.1), at(1, 1, 0, 0, -3.1), gates));
  EXPECT_FALSE(is_loop_candidate(at(50, 0, 0, 0, 0.0), at(1, 1, 0, 0, 3.1), gates));
}

TEST(LoopDetector, GatesTheIndexGap) {
  const LoopGates gates;
  EXPECT_TRUE(is_loop_candidate(at(50, 0, 0, 0), at(40, 0, 0, 0), gates));
  EXPECT_FALSE(is_loop_candidate(at(50, 0, 0, 0), at(41, 0, 0, 0), gates));
  EXPECT_FALSE(is_loop_candidate(at(50, 0, 0, 0), at(50, 0, 0, 0), gates));
}

/// Keyframes with the index and the odometry that the search needs; odometry equals the poses.
struct Space {
  explicit Space(std::vector<KeyframePose> keyframes, const Matrix6d& step_covariance = Matrix6d::Zero())
      : poses(std::move(keyframes)) {
    const Matrix6d definite = step_covariance + 1e-18 * Matrix6d::Identity();
    for (std::size_t i = 0; i < poses.size(); ++i) {
      places.place(i, poses[i].T_map_body.translation);
      odometry.append(poses[i].T_map_body, definite, Matrix6d::Zero());
    }
  }
  [[nodiscard]] std::vector<std::size_t> candidates(double sigmas, double most_m) const {
    return loop_candidates({poses, places, odometry}, LoopGates(), sigmas, most_m);
  }

  std::vector<KeyframePose> poses;
  PlaceIndex places{8.0};
  OdometryChain odometry;
};

TEST(LoopDetector, ListsTheOldestFirst) {
  std::vector<KeyframePose> poses;
  for (int i = 0; i < 30; ++i) poses.push_back(at(i, i % 2 == 0 ? 1.0 : 100.0, 0, 0));
  poses.push_back(at(30, 0, 0, 0));
  EXPECT_EQ(Space(poses).candidates(3.0, 8.0), (std::vector<std::size_t>{0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20}));
}

TEST(LoopDetector, ReachesFartherWhereOdometryKnowsLess) {
  std::vector<KeyframePose> poses;
  for (int i = 0; i < 20; ++i) poses.push_back(at(i, i == 0 ? 10.0 : 60.0, 0, 0));
  poses.push_back(at(20, 0, 0, 0));
  Matrix6d drift = Matrix6d::Zero();
  drift(3, 3) = drift(5, 5) = 0.5 * 0.15 * 0.15;  // horizontally 0.15 m a step, 0.67 m over 20 steps
  EXPECT_TRUE(Space(poses).candidates(3.0, 8.0).empty());
  EXPECT_EQ(Space(poses, drift).candidates(3.0, 8.0), (std::vector<std::size_t>{0}));
  EXPECT_TRUE(Space(poses, drift).candidates(2.9, 8.0).empty());
  EXPECT_TRUE(Space(poses, drift).candidates(3.0, 1.9).empty()) << "at most so much";
  drift.setZero();
  drift(4, 4) = 1.0;
  EXPECT_TRUE(Space(poses, drift).candidates(3.0, 8.0).empty()) << "height does not count";
}

TEST(LoopDetector, TurnsFartherWhereOdometryKnowsLess) {
  std::vector<KeyframePose> poses;
  for (int i = 0; i < 20; ++i) poses.push_back(at(i, i == 0 ? 1.0 : 60.0, 0, 0));
  poses.push_back(at(20, 0, 0, 0, std::numbers::pi / 2.0 + 0.2));
  Matrix6d drift = Matrix6d::Zero();
  EXPECT_TRUE(Space(poses, drift).candidates(3.0, 0.0).empty());
  drift(1, 1) = 0.07 * 0.07 / 20.0;
  EXPECT_EQ(Space(poses, drift).candidates(3.0, 0.0), (std::vector<std::size_t>{0}));
  EXPECT_TRUE(Space(poses, drift).candidates(2.8, 0.0).empty());
}

TEST(LoopDetector, ChoosesTheOldestThenTheNearestThatStandApart) {
  std::vector<KeyframePose> poses;
  for (int i = 0; i < 20; ++i) poses.push_back(at(i, std::abs(10.0 - i), 0, 0));
  std::vector<std::size_t> candidates(20);
  for (std::size_t i = 0; i < 20; ++i) candidates[i] = i;
  const KeyframePose current = at(40, 0, 0, 0);
  EXPECT_EQ(choose_candidates(candidates, poses, current, 4, 2), (std::vector<std::size_t>{0, 10, 7, 13}));
  EXPECT_EQ(choose_candidates(candidates, poses, current, 1, 2), (std::vector<std::size_t>{0}));
  EXPECT_TRUE(choose_candidates({}, poses, current, 4, 2).empty());
  // Next to each other in the graph, since those between them were absorbed.
  const std::vector<KeyframePose> two = {at(20, 1, 0, 0), at(35, 2, 0, 0)};
  EXPECT_EQ(choose_candidates(std::vector<std::size_t>{0, 1}, two, current, 4, 2), (std::vector<std::size_t>{0, 1}));
}

}  // namespace
}  // namespace ignis
