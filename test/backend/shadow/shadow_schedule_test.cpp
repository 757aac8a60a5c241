// SPDX-License-Identifier: Apache-2.0
#include "backend/shadow/shadow_schedule.h"

#include <gtest/gtest.h>

namespace ignis {
namespace {

LoopResult result(LoopReason reason) {
  LoopResult loop;
  loop.reason = reason;
  return loop;
}

SmootherUpdate with_loop(LoopReason reason) {
  SmootherUpdate update;
  update.loop = result(reason);
  return update;
}

SmootherUpdate with_change(LoopReason reason) {
  SmootherUpdate update;
  update.changed.push_back(result(reason));
  return update;
}

SmootherStats graph_of(int keyframes, int retired = 0) {
  SmootherStats graph;
  graph.keyframes = keyframes;
  graph.retired = retired;
  return graph;
}

TEST(ShadowSchedule, BeginsWhenALoopEntersOrLeaves) {
  for (const SmootherUpdate& update :
       {with_loop(LoopReason::kAccepted), with_change(LoopReason::kAccepted), with_change(LoopReason::kWithdrawn)}) {
    ShadowSchedule schedule;
    schedule.note(update);
    EXPECT_TRUE(schedule.begin_due());
    schedule.note({});
    EXPECT_TRUE(schedule.begin_due()) << "until it has begun";
  }
}

TEST(ShadowSchedule, DoesNotBeginForWhatChangesNoFactor) {
  ShadowSchedule schedule;
  EXPECT_FALSE(schedule.begin_due());
  schedule.note({});
  schedule.note(with_loop(LoopReason::kTooFewMatched));
  schedule.note(with_change(LoopReason::kKept));
  schedule.note(with_change(LoopReason::kNeedsSupport));
  EXPECT_FALSE(schedule.begin_due());
}

TEST(ShadowSchedule, IsDueACountOfKeyframesLater) {
  ShadowSchedule schedule;
  EXPECT_FALSE(schedule.adoption_due(1'000'000)) << "nothing has begun";
  schedule.begin(graph_of(20));
  EXPECT_TRUE(schedule.pending());
  EXPECT_FALSE(schedule.adoption_due(20));
  EXPECT_TRUE(schedule.adoption_due(20 + shadow_delay(20)));
  EXPECT_TRUE(schedule.adoption_due(21 + shadow_delay(20)));
  schedule.end();
  EXPECT_FALSE(schedule.adoption_due(100));
}

TEST(ShadowSchedule, DoesNotWaitForKeyframesThatHaveRetired) {
  ShadowSchedule schedule;
  schedule.begin(graph_of(4'000, 3'000));
  EXPECT_FALSE(schedule.adoption_due(3'999 + shadow_delay(1'000)));
  EXPECT_TRUE(schedule.adoption_due(4'000 + shadow_delay(1'000)));
}

TEST(ShadowSchedule, GivesALargerGraphMoreKeyframes) {
  EXPECT_EQ(shadow_delay(0), 1);
  EXPECT_EQ(shadow_delay(49), 1);
  EXPECT_EQ(shadow_delay(10'000), 201);
}

TEST(ShadowSchedule, RemembersALoopThatCameMeanwhile) {
  ShadowSchedule schedule;
  schedule.note(with_loop(LoopReason::kAccepted));
  schedule.begin(graph_of(20));
  EXPECT_FALSE(schedule.begin_due());
  schedule.note(with_loop(LoopReason::kAccepted));
  EXPECT_FALSE(schedule.begin_due()) << "one at a time";
  schedule.end();
  EXPECT_TRUE(schedule.begin_due());
  schedule.begin(graph_of(21));
  schedule.end();
  EXPECT_FALSE(schedule.begin_due());
}

}  // namespace
}  // namespace ignis
