// SPDX-License-Identifier: Apache-2.0
#include "graph_backend/backend_health.h"

#include <gtest/gtest.h>

#include "ignis/health_t.hpp"

namespace ignis {
namespace {

BackendSituation after(int keyframes) {
  BackendSituation situation;
  situation.graph.keyframes = keyframes;
  return situation;
}

TEST(BackendHealth, SaysHowFarTheGraphIsFromTheBatchOptimumAndHowManyKeyframesHaveRetired) {
  EXPECT_EQ(health_of({}).text, "OK: no keyframe yet");
  BackendSituation situation = after(5'000);
  EXPECT_EQ(health_of(situation).text, "OK");
  situation.graph.retired = 1'000;
  EXPECT_EQ(health_of(situation).text, "OK; the oldest 1000 of 5000 keyframes have retired");
  situation.graph.absorbed = 800;
  EXPECT_EQ(health_of(situation).text,
            "OK; the oldest 1000 of 5000 keyframes have retired, others stand for 800 of them");
  situation.graph.absorbed = 0;
  situation.graph.shadow_checks = 3;
  situation.graph.shadow_swaps = 1;
  situation.graph.shadow_gap_m = 0.0012;
  situation.graph.shadow_gap_rad = 0.00034;
  EXPECT_EQ(health_of(situation).text,
            "OK: 1.2 mm and 0.34 mrad from the batch optimum at most; swapped 1 times; the oldest 1000 of 5000 "
            "keyframes have retired");
  EXPECT_EQ(health_of(situation).state, health_t::OK);
}

TEST(BackendHealth, TellsTheWorstThatHasHappened) {
  BackendSituation situation = after(10);
  situation.graph.clouds_forgotten = 4;
  EXPECT_EQ(health_of(situation).state, health_t::OK);
  EXPECT_NE(health_of(situation).text.find("4 clouds"), std::string::npos);
  situation.graph.clouds_unreadable = 2;
  EXPECT_NE(health_of(situation).text.find("2 times"), std::string::npos);
  situation.keyframes_given_up = 3;
  situation.gave_up_lately = true;
  EXPECT_EQ(health_of(situation).text, "3 keyframes are given up; the graph has holes there");
  situation.waiting_for = 8;
  EXPECT_EQ(health_of(situation).text, "waiting for keyframe 8");
  situation.refusal = "keyframe 7 is damaged";
  EXPECT_EQ(health_of(situation).text, "keyframe 7 is damaged");
  EXPECT_EQ(health_of(situation).state, health_t::DEGRADED);
  situation.journal_failure = "no space left";
  EXPECT_EQ(health_of(situation).text, "no space left");
  EXPECT_EQ(health_of(situation).state, health_t::FAULT) << "it needs a person";
  situation.graph.solver_failure = "it is singular";
  EXPECT_NE(health_of(situation).text.find("it is singular"), std::string::npos);
  EXPECT_EQ(health_of(situation).state, health_t::FAULT);
}

TEST(BackendHealth, ForgetsAfterAWhileThatSomethingWasLostButNotHowOften) {
  BackendSituation situation = after(10);
  situation.graph.clouds_unreadable = 2;
  situation.missed_a_cloud_lately = true;
  EXPECT_EQ(health_of(situation).state, health_t::DEGRADED);
  situation.missed_a_cloud_lately = false;
  EXPECT_EQ(health_of(situation).state, health_t::OK);
  EXPECT_EQ(health_of(situation).text.rfind("OK: 2 times", 0), 0U);
  situation.graph.clouds_unreadable = 0;
  situation.keyframes_given_up = 3;
  EXPECT_EQ(health_of(situation).state, health_t::OK);
}

}  // namespace
}  // namespace ignis
