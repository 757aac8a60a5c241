// SPDX-License-Identifier: Apache-2.0
#include "messages/graph_messages.h"

#include <gtest/gtest.h>

#include "common/so3.h"

namespace ignis::messages {
namespace {

GraphRevision revision_of(int poses) {
  GraphRevision revision;
  revision.utime = 77;
  revision.session = 3;
  revision.revision = 12;
  revision.full = true;
  revision.keyframes = poses;
  revision.newest_id = poses - 1;
  revision.T_map_odom = {so3::exp({0.0, 0.1, 0.0}), {1.0, 2.0, 3.0}};
  revision.covariance = Matrix6d::Random();
  for (int i = 0; i < poses; ++i) revision.poses.push_back({i, {so3::exp({0.0, 0.01 * i, 0.0}), {1.0 * i, 0.0, 0.0}}});
  return revision;
}

class RevisionParts : public testing::TestWithParam<int> {};

TEST_P(RevisionParts, FitOneDatagramEachAndComeTogetherAgain) {
  const GraphRevision revision = revision_of(GetParam());
  RevisionAssembler assembler;
  std::optional<GraphRevision> back;
  for (const smoothed_keyframes_t& part : to_messages(revision)) {
    EXPECT_LE(part.getEncodedSize(), 64'000);
    ASSERT_FALSE(back);
    back = assembler.add(part);
  }
  ASSERT_TRUE(back);
  EXPECT_EQ(back->utime, 77);
  EXPECT_EQ(back->session, 3);
  EXPECT_EQ(back->revision, 12);
  EXPECT_TRUE(back->full);
  EXPECT_EQ(back->keyframes, GetParam());
  EXPECT_EQ(back->covariance, revision.covariance);
  EXPECT_EQ(body_difference(back->T_map_odom, revision.T_map_odom).norm(), 0.0);
  ASSERT_EQ(back->poses.size(), revision.poses.size());
  for (std::size_t i = 0; i < revision.poses.size(); ++i) {
    ASSERT_EQ(back->poses[i].id, revision.poses[i].id);
    ASSERT_EQ(body_difference(back->poses[i].T_map_body, revision.poses[i].T_map_body).norm(), 0.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, RevisionParts, testing::Values(0, 1, 900, 901, 5000));

TEST(LoopMessages, CarryOutcomeFiguresAndWords) {
  LoopResult result;
  result.reason = LoopReason::kResidualTooLarge;
  result.from_id = 30;
  result.to_id = 2;
  result.mean_residual = 0.07;
  result.overlap = 0.8;
  result.chi_square = 3.5;
  result.chi_square_bound = 22.5;
  result.stage = LoopStage::kCandidate;
  result.T_to_from.translation = {1.0, 2.0, 3.0};
  const loop_result_t message = to_message(result, 5);
  EXPECT_EQ(message.reason, loop_result_t::RESIDUAL_TOO_LARGE);
  EXPECT_EQ(message.accepted, 0);
  EXPECT_FALSE(message.reason_text.empty());
  EXPECT_EQ(message.session, 5);
  EXPECT_EQ(message.from_id, 30);
  EXPECT_EQ(message.mean_residual, 0.07);
  EXPECT_EQ(message.overlap, 0.8);
  EXPECT_EQ(message.chi_square, 3.5);
  EXPECT_EQ(message.chi_square_bound, 22.5);
  EXPECT_EQ(message.stage, loop_result_t::STAGE_CANDIDATE);
  EXPECT_EQ(message.relative_position[2], 3.0);
}

TEST(LoopMessages, NumberReasonsAndStagesAsTheCoreDoes) {
  const auto reason = [](LoopReason value) { return static_cast<std::int8_t>(value); };
  const auto stage = [](LoopStage value) { return static_cast<std::int8_t>(value); };
  EXPECT_EQ(reason(LoopReason::kWithdrawn), loop_result_t::WITHDRAWN);
  EXPECT_EQ(reason(LoopReason::kTooLittleOverlap), loop_result_t::TOO_LITTLE_OVERLAP);
  EXPECT_EQ(reason(LoopReason::kContradictsOdometry), loop_result_t::CONTRADICTS_ODOMETRY);
  EXPECT_EQ(reason(LoopReason::kContradictsLoops), loop_result_t::CONTRADICTS_LOOPS);
  EXPECT_EQ(reason(LoopReason::kNeedsSupport), loop_result_t::NEEDS_SUPPORT);
  EXPECT_EQ(reason(LoopReason::kKept), loop_result_t::KEPT);
  EXPECT_EQ(reason(LoopReason::kVetoed), loop_result_t::VETOED);
  EXPECT_EQ(reason(LoopReason::kCloudLost), loop_result_t::CLOUD_LOST);
  EXPECT_EQ(reason(LoopReason::kContradictsGraph), loop_result_t::CONTRADICTS_GRAPH);
  EXPECT_EQ(stage(LoopStage::kNone), loop_result_t::STAGE_NO_LOOP);
  EXPECT_EQ(stage(LoopStage::kVerified), loop_result_t::STAGE_VERIFIED);
  EXPECT_EQ(stage(LoopStage::kOnTrial), loop_result_t::STAGE_ON_TRIAL);
  EXPECT_EQ(stage(LoopStage::kKept), loop_result_t::STAGE_KEPT);
  EXPECT_EQ(stage(LoopStage::kWithdrawn), loop_result_t::STAGE_WITHDRAWN);
}

}  // namespace
}  // namespace ignis::messages
