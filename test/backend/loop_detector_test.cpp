// SPDX-License-Identifier: Apache-2.0
#include "backend/loop_detector.h"

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

TEST(LoopDetector, ListsTheOldestFirst) {
  std::vector<KeyframePose> poses;
  for (int i = 0; i < 30; ++i) poses.push_back(at(i, i % 2 == 0 ? 1.0 : 100.0, 0, 0));
  const auto found = loop_candidates(poses, at(30, 0, 0, 0), LoopGates());
  EXPECT_EQ(found, (std::vector<std::size_t>{0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20}));
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
}

}  // namespace
}  // namespace ignis
