// SPDX-License-Identifier: Apache-2.0
#include "graph_backend/lasting_graph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "backend/laps.h"
#include "process_cost.h"
#include "slow_build.h"
#include "test_folder.h"

/// What a graph of thousands of keyframes costs when it must be built anew: out of its own list, because the solver
/// threw, and out of the journal, because the process was killed.
namespace ignis {
namespace {

namespace fs = std::filesystem;
using bench::processor_ms;

constexpr int kKeyframes = 2000;
constexpr int kLoopEvery = 27;
constexpr double kLimitMs = kKeyframes / 5000.0 * 1000.0 * test::kBuildSlowdown;

class LastingGraphTest : public ::testing::Test {
 protected:
  LastingGraphTest() {
    config_.backend.use_loop_closing = false;
    config_.backend.loop_support_beyond_m = 1000.0;  // a loop needs no second one
  }
  ~LastingGraphTest() override { fs::remove_all(folder_); }

  /// With loops to the laps before.
  void drive(LastingGraph& graph) const {
    graph.begin_session(0);
    for (int i = 0; i < kKeyframes; ++i) {
      const Keyframe& keyframe = drive_.keyframes[static_cast<std::size_t>(i)];
      ASSERT_TRUE(graph.change([&](Smoother& smoother) { return smoother.add_keyframe(keyframe); }).accepted());
      if (i < 3 * testing::kLap || i % kLoopEvery != 0) continue;
      const LoopMeasurement loop = testing::loop_in(drive_, i, i - testing::kLap * (1 + i % 3));
      static_cast<void>(graph.change([&](Smoother& smoother) { return smoother.add_loop(loop); }));
    }
    ASSERT_GT(graph.smoother().stats().loops_kept, 60);
  }

  runtime::IgnisConfig config_;
  testing::Drive drive_ = testing::make_drive({.seed = 1, .keyframes = kKeyframes + 1});
  fs::path folder_ = test::fresh_folder();
};

/// Believed, for it says what the graph says, but so sure of itself that no digits are left for the rest.
LoopMeasurement poison(const std::vector<KeyframePose>& poses, int from, int to) {
  const auto pose = [&](int id) { return poses[static_cast<std::size_t>(id)].T_map_body; };
  return {from, to, pose(to).inverse() * pose(from), 1e20 * Matrix6d::Identity()};
}

double largest_distance(const std::vector<KeyframePose>& a, const std::vector<KeyframePose>& b) {
  EXPECT_EQ(a.size(), b.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    largest = std::max(largest, (a[i].T_map_body.translation - b[i].T_map_body.translation).norm());
  }
  return largest;
}

using Fault_G4 = LastingGraphTest;
using Fault_P3 = LastingGraphTest;

TEST_F(Fault_G4, AGraphOfThousandsIsRebuiltWithinASecondPer5000KeyframesAndGoesOn) {
  LastingGraph graph(config_, {});
  drive(graph);
  const std::vector<KeyframePose> before = graph.smoother().all_poses();
  const LoopMeasurement loop = poison(before, kKeyframes - 5, 7);
  const double began = processor_ms();
  const SmootherUpdate update = graph.change([&](Smoother& smoother) { return smoother.add_loop(loop); });
  const double spent_ms = processor_ms() - began;
  std::printf("rebuilt %d keyframes in %.0f ms: %s\n", kKeyframes, spent_ms, update.loop->reason_text.c_str());
  ASSERT_EQ(graph.smoother().stats().solver_rebuilds, 1) << "the solver did not throw: the test shows nothing";
  EXPECT_EQ(update.loop->reason, LoopReason::kSolverRefused);
  EXPECT_LT(spent_ms, kLimitMs);
  EXPECT_LT(largest_distance(before, graph.smoother().all_poses()), 1e-3);
  EXPECT_TRUE(
      graph.change([&](Smoother& smoother) { return smoother.add_keyframe(drive_.keyframes.back()); }).accepted());
}

TEST_F(Fault_P3, AGraphOfThousandsIsBackOutOfItsJournalWithinASecondPer5000Keyframes) {
  std::optional<LastingGraph> graph(std::in_place, config_, folder_);
  drive(*graph);
  const std::vector<KeyframePose> before = graph->smoother().all_poses();
  const SmootherStats stats = graph->smoother().stats();
  graph.reset();
  const double began = processor_ms();
  graph.emplace(config_, folder_);
  const double spent_ms = processor_ms() - began;
  std::printf("%s: %.0f ms of a processor\n", graph->resume_note().c_str(), spent_ms);
  EXPECT_EQ(graph->smoother().stats().keyframes, kKeyframes);
  EXPECT_EQ(graph->smoother().stats().loops_kept, stats.loops_kept);
  EXPECT_LT(spent_ms, kLimitMs);
  EXPECT_LT(largest_distance(before, graph->smoother().all_poses()), 1e-3);
}

}  // namespace
}  // namespace ignis
