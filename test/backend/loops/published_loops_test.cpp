// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

#include "backend/recorded_data.h"
#include "graph_study.h"

/// Published pose graphs with wrong loops among their own before the admission and trial of the back end.
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

bench::GraphOutcome outcome_with(const bench::GraphStudy& study, double share, const BackendConfig& config) {
  const std::vector<bench::StudyLoop> loops = bench::with_lies(study.drive, share, bench::Lies::kIndependent, 1);
  const bench::GraphOutcome outcome = bench::judged(study, loops, config);
  std::printf("true kept %d of %d, false kept %d of %d, ATE %.3f of clean, p99 %.1f ms\n", outcome.true_kept,
              outcome.true_tried, outcome.false_kept, outcome.false_tried, outcome.ate_ratio, outcome.p99_ms);
  return outcome;
}

TEST(FalseLoops, OfAPublishedGraphAreKeptOut) {
  const auto file = testing::recorded_data("posegraphs/parking-garage.g2o");
  IGNIS_REQUIRE_DATA(file);
  // Its edges claim a metre each. So much more they know, by the chi-square of the whole graph at its optimum.
  constexpr double kInformationScale = 21'830.0;
  const bench::GraphStudy study = bench::graph_study(read_pose_graph(file), 600, kInformationScale);
  const BackendConfig config = of_a_graph(1.0);
  const bench::GraphOutcome half = outcome_with(study, 0.5, config);
  EXPECT_GT(half.false_tried, 50);
  EXPECT_EQ(half.false_kept, 0);
  EXPECT_GE(half.true_kept, 0.95 * half.true_tried);
  EXPECT_LT(half.ate_ratio, 1.1);
  const bench::GraphOutcome nearly_all = outcome_with(study, 0.9, config);
  EXPECT_GT(nearly_all.false_tried, 1500);
  EXPECT_EQ(nearly_all.false_kept, 0);
  EXPECT_GE(nearly_all.true_kept, 0.95 * nearly_all.true_tried);
}

}  // namespace
}  // namespace ignis
