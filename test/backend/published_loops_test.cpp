// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdio>

#include "backend/recorded_data.h"
#include "graph_study.h"

/// Published pose graphs with wrong loops among their own, half of all, before the admission and trial of the back end.
/// Their first part only, for the sake of time. Run by hand, the test prints its table.
namespace ignis {
namespace {

/// What suits a graph instead of a drive of ours: no edge but its own, and any other loop may be support, since places
/// of these graphs are not rooms.
BackendConfig of_a_graph(double support_beyond_m) {
  BackendConfig config;
  config.loose_position_m = 100.0;
  config.loose_rotation_rad = 3.0;
  config.loop_support_apart_m = 0.0;
  config.loop_support_beyond_m = support_beyond_m;
  return config;
}

void expect_no_harm(const bench::GraphStudy& study, bench::Lies lies, const BackendConfig& config, double recall) {
  const bench::GraphOutcome outcome = bench::judged(study, bench::with_lies(study.drive, 0.5, lies, 1), config);
  std::printf("true kept %d of %d, false kept %d of %d, ATE %.3f of clean, p99 %.1f ms\n", outcome.true_kept,
              outcome.true_tried, outcome.false_kept, outcome.false_tried, outcome.ate_ratio, outcome.p99_ms);
  EXPECT_GT(outcome.false_tried, 50);
  EXPECT_EQ(outcome.false_kept, 0);
  EXPECT_GE(outcome.true_kept, recall * outcome.true_tried);
  EXPECT_LT(outcome.ate_ratio, 1.1);
}

TEST(FalseLoops, OfAPublishedGraphAreKeptOut) {
  const auto file = testing::recorded_data("posegraphs/parking-garage.g2o");
  IGNIS_REQUIRE_DATA(file);
  // Its edges claim a metre each. So much more they know, by the chi-square of the whole graph at its optimum.
  constexpr double kInformationScale = 21'830.0;
  const bench::GraphStudy study = bench::graph_study(read_pose_graph(file), 600, kInformationScale);
  expect_no_harm(study, bench::Lies::kIndependent, of_a_graph(1.0), 0.95);
}

}  // namespace
}  // namespace ignis
