// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <random>
#include <tuple>

#include "backend/journal/graph_change.h"
#include "backend/laps.h"
#include "backend/smoother.h"
#include "backend/synthetic_drive.h"
#include "backend/text_contains.h"
#include "common/so3.h"

/// A smoother out of its journal is the smoother that wrote it.
namespace ignis {
namespace {

using Records = std::vector<std::vector<std::byte>>;

constexpr double kSamePosition = 1e-6;  // [m]

/// One thing that happens to a smoother.
struct Step {
  const Keyframe* keyframe = nullptr;
  std::int32_t gap_before = -1;
  std::optional<LoopMeasurement> loop;
};

void take(Smoother& smoother, const Step& step) {
  if (step.gap_before >= 0) smoother.accept_gap_before(step.gap_before);
  if (step.keyframe != nullptr) static_cast<void>(smoother.add_keyframe(*step.keyframe));
  if (step.loop) static_cast<void>(smoother.add_loop(*step.loop));
}

SmootherRestoration restored(const Records& records, const BackendConfig& config = {}) {
  const std::vector<std::span<const std::byte>> spans(records.begin(), records.end());
  return restore_smoother(config, LoopGates(), spans);
}

LoopMeasurement random_loop(const testing::Drive& drive, int newest, bool is_true, std::mt19937& random) {
  std::normal_distribution<double> normal;
  LoopMeasurement loop;
  loop.from_id = newest - static_cast<int>(random() % 3);
  loop.to_id = static_cast<int>(random() % static_cast<unsigned>(loop.from_id - 8));
  const auto at = [&](std::int32_t id) { return drive.T_world_body[static_cast<std::size_t>(id)]; };
  Pose error;
  const double size = is_true ? 1.0 : 100.0;
  error.rotation = so3::exp(0.003 * size * Eigen::Vector3d(normal(random), normal(random), normal(random)));
  error.translation = 0.02 * size * Eigen::Vector3d(normal(random), normal(random), normal(random));
  loop.T_to_from = at(loop.to_id).inverse() * at(loop.from_id) * error;
  Vector6d information;
  information << Eigen::Vector3d::Constant(1.0 / (0.003 * 0.003)), Eigen::Vector3d::Constant(1.0 / (0.02 * 0.02));
  loop.information = information.asDiagonal();
  return loop;
}

/// Keyframes with some left out, with loops true and false in between.
std::vector<Step> random_steps(const testing::Drive& drive, std::mt19937& random) {
  std::vector<Step> steps;
  for (const Keyframe& keyframe : drive.keyframes) {
    if (keyframe.id > 2 && random() % 15 == 0) {
      steps.push_back({.keyframe = nullptr, .gap_before = keyframe.id + 1, .loop = {}});
      continue;
    }
    steps.push_back({.keyframe = &keyframe, .gap_before = -1, .loop = {}});
    if (keyframe.id < 12 || random() % 4 != 0) continue;
    const bool is_true = random() % 3 != 0;
    steps.push_back({.keyframe = nullptr, .gap_before = -1, .loop = random_loop(drive, keyframe.id, is_true, random)});
  }
  return steps;
}

void expect_same(const Smoother& a, const Smoother& b) {
  EXPECT_EQ(a.revision(), b.revision());
  EXPECT_EQ(a.expected_id(), b.expected_id());
  EXPECT_EQ(a.stats().retired, b.stats().retired);
  EXPECT_EQ(a.stats().absorbed, b.stats().absorbed);
  EXPECT_EQ(a.stats().loops_kept, b.stats().loops_kept);
  EXPECT_EQ(a.stats().loops_withdrawn, b.stats().loops_withdrawn);
  EXPECT_EQ(a.stats().without_imu, b.stats().without_imu);
  ASSERT_EQ(a.all_poses().size(), b.all_poses().size());
  for (std::size_t i = 0; i < a.all_poses().size(); ++i) {
    const Vector6d difference = body_difference(a.all_poses()[i].T_map_body, b.all_poses()[i].T_map_body);
    ASSERT_EQ(a.all_poses()[i].id, b.all_poses()[i].id);
    ASSERT_LT(difference.tail<3>().norm(), kSamePosition) << "keyframe " << a.all_poses()[i].id;
  }
  const PoseGraph graph = a.pose_graph();
  const PoseGraph other = b.pose_graph();
  ASSERT_EQ(graph.edges.size(), other.edges.size());
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    EXPECT_EQ(graph.edges[i].from, other.edges[i].from);
    EXPECT_EQ(graph.edges[i].to, other.edges[i].to);
    EXPECT_EQ(graph.edges[i].is_loop, other.edges[i].is_loop);
    // Where a matrix begins in memory decides how its product is rounded.
    EXPECT_TRUE(graph.edges[i].information.isApprox(other.edges[i].information, 1e-12));
  }
}

/// Histories with gaps leave odometry vague; here their loops enter all the same, on any second loop's word.
BackendConfig trusting(int estimated_keyframes = 1000) {
  BackendConfig config;
  config.estimated_keyframes = estimated_keyframes;
  config.loop_support_beyond_m = 2.0;
  config.loop_support_apart_m = 0.0;
  return config;
}

/// Seed, and keyframes that are estimated at most.
class SmootherJournal : public ::testing::TestWithParam<std::tuple<unsigned, int>> {};

TEST_P(SmootherJournal, KilledAnywhereEndsWithTheSameGraph) {
  const auto [seed, estimated_keyframes] = GetParam();
  const BackendConfig config = trusting(estimated_keyframes);
  std::mt19937 random(seed);
  const testing::Drive drive = testing::make_drive({.seed = seed, .keyframes = 60, .cloud_points = 0});
  const std::vector<Step> steps = random_steps(drive, random);
  Smoother uninterrupted{config, LoopGates()};
  Smoother killed{config, LoopGates()};
  Records records;
  int kills = 0;
  for (const Step& step : steps) {
    take(uninterrupted, step);
    take(killed, step);
    records.push_back(killed.take_change());
    if (random() % 8 != 0) continue;
    SmootherRestoration restoration = restored(records, config);
    EXPECT_EQ(restoration.problem, "");
    EXPECT_EQ(restoration.records_used, records.size());
    expect_same(killed, restoration.smoother);
    killed = std::move(restoration.smoother);
    ++kills;
  }
  EXPECT_GE(kills, 3);
  EXPECT_GE(uninterrupted.stats().loops_kept, 3);
  EXPECT_EQ(uninterrupted.stats().retired > 0, estimated_keyframes < 60);
  expect_same(uninterrupted, killed);
  const SmootherUpdate expected = uninterrupted.present();
  const SmootherUpdate restarted = killed.present();
  EXPECT_TRUE(expected.covariance_valid && restarted.covariance_valid);
  EXPECT_TRUE(restarted.covariance.isApprox(expected.covariance, 1e-3));
  EXPECT_EQ(restarted.revision, expected.revision);
}

INSTANTIATE_TEST_SUITE_P(Seeds, SmootherJournal,
                         ::testing::Combine(::testing::Range(1U, 13U), ::testing::Values(1000, 24)));

TEST(SmootherJournalThinning, KilledAnywhereEndsWithTheSamePlaces) {
  const testing::Drive drive = testing::make_drive({.seed = 3, .keyframes = 160});
  BackendConfig config = trusting(40);
  config.use_loop_closing = false;
  Smoother uninterrupted{config, LoopGates()};
  Smoother killed{config, LoopGates()};
  Records records;
  for (const Keyframe& keyframe : drive.keyframes) {
    Step step{.keyframe = &keyframe, .gap_before = -1, .loop = {}};
    const bool closes = keyframe.id >= testing::kLap && keyframe.id % 3 == 0;
    // Every other one to the lap before: such a keyframe is absorbed as soon as the loop has retired.
    const int to = keyframe.id % 2 == 0 ? keyframe.id - testing::kLap : keyframe.id % testing::kLap;
    if (closes) step.loop = testing::loop_in(drive, keyframe.id, to);
    take(uninterrupted, step);
    take(killed, step);
    records.push_back(killed.take_change());
    if (keyframe.id % 7 != 0) continue;
    SmootherRestoration restoration = restored(records, config);
    EXPECT_EQ(restoration.problem, "");
    expect_same(killed, restoration.smoother);
    killed = std::move(restoration.smoother);
  }
  EXPECT_GT(uninterrupted.stats().absorbed, 70);
  expect_same(uninterrupted, killed);
}

TEST(SmootherJournalSearch, FindsTheSameLoopsAfterwards) {
  const testing::Drive drive = testing::make_drive({.seed = 2, .keyframes = 45, .cloud_points = 3000});
  Smoother uninterrupted{BackendConfig(), LoopGates()};
  Smoother killed{BackendConfig(), LoopGates()};
  Records records;
  for (const Keyframe& keyframe : drive.keyframes) {
    static_cast<void>(uninterrupted.add_keyframe(keyframe));
    static_cast<void>(killed.add_keyframe(keyframe));
    records.push_back(killed.take_change());
    if (keyframe.id % 9 == 5) killed = restored(records).smoother;
  }
  EXPECT_GE(uninterrupted.stats().loops_kept, 3);
  expect_same(uninterrupted, killed);
}

TEST(SmootherJournalRecords, NothingAtAllIsAnEmptyGraph) {
  const SmootherRestoration restoration = restored({});
  EXPECT_EQ(restoration.problem, "");
  EXPECT_EQ(restoration.smoother.expected_id(), 0);
}

TEST(SmootherJournalRecords, TheFirstThatDoesNotFitEndsItAndIsNamed) {
  const testing::Drive drive = testing::make_drive({.seed = 3, .keyframes = 6});
  Smoother smoother{BackendConfig(), LoopGates()};
  Records records;
  for (const Keyframe& keyframe : drive.keyframes) {
    static_cast<void>(smoother.add_keyframe(keyframe));
    records.push_back(smoother.take_change());
  }
  Records hole = records;
  hole.erase(hole.begin() + 3);
  const SmootherRestoration restoration = restored(hole);
  EXPECT_EQ(restoration.records_used, 3U);
  EXPECT_TRUE(testing::contains(restoration.problem, "keyframe 4 is not linked"));
  EXPECT_EQ(restoration.smoother.expected_id(), 3);
  Records cut = records;
  cut[2].pop_back();
  EXPECT_EQ(restored(cut).records_used, 2U);
  EXPECT_TRUE(testing::contains(restored(cut).problem, "no change of a graph"));
}

/// Records of laps until keyframes have retired for the second time.
Records records_of_laps(const BackendConfig& config) {
  const testing::Drive drive = testing::make_drive({.seed = 3, .keyframes = 46});
  Smoother smoother(config, LoopGates());
  std::mt19937 random(3);
  Records records;
  for (const Keyframe& keyframe : drive.keyframes) {
    static_cast<void>(smoother.add_keyframe(keyframe));
    if (keyframe.id >= 21) static_cast<void>(smoother.add_loop(random_loop(drive, keyframe.id, true, random)));
    records.push_back(smoother.take_change());
    if (decode_change(records.back())->retired && keyframe.id > 42) return records;
  }
  return {};
}

TEST(SmootherJournalRecords, ARetirementThatCannotBeIsRefusedAndNamed) {
  BackendConfig config = trusting(40);
  config.use_loop_closing = false;
  const Records sound = records_of_laps(config);
  ASSERT_FALSE(sound.empty());
  EXPECT_EQ(restored(sound, config).problem, "");
  const auto problem = [&](const auto& spoil) {
    Records records = sound;
    GraphChange change = decode_change(sound.back()).value();
    spoil(change);
    records.back() = encode_change(change);
    const SmootherRestoration restoration = restored(records, config);
    EXPECT_EQ(restoration.records_used, sound.size() - 1);
    EXPECT_GT(restoration.smoother.stats().keyframes, 40);
    return restoration.problem;
  };
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(testing::contains(problem([](GraphChange& change) { change.retired->blocks.back().until = 4000; }),
                                "keyframes have retired"));
  EXPECT_TRUE(testing::contains(problem([](GraphChange& change) { change.retired->blocks.clear(); }),
                                "keyframes have retired"));
  EXPECT_TRUE(testing::contains(
      problem([&](GraphChange& change) { change.retired->blocks.back().covariance(0, 0) = none; }), "is none"));
  EXPECT_TRUE(testing::contains(
      problem([&](GraphChange& change) { change.retired->newest_motion.covariance(2, 2) = none; }), "is not known"));
  EXPECT_TRUE(testing::contains(
      problem([](GraphChange& change) { change.retired->newest_motion.covariance(2, 2) = -1.0; }), "is not known"));
  EXPECT_TRUE(testing::contains(problem([](GraphChange& change) {
                                  GraphLoop young;
                                  young.result.from_id = 42;
                                  change.retired->loops.push_back(young);
                                }),
                                "before its keyframes"));
  EXPECT_TRUE(testing::contains(problem([](GraphChange& change) {
                                  GraphLoop old;
                                  old.result.from_id = 3;
                                  old.result.to_id = 1;
                                  change.waiting.appended.push_back(old);
                                }),
                                "between keyframes that have retired"));
  EXPECT_TRUE(
      testing::contains(problem([](GraphChange& change) { change.state.links.clear(); }), "links of keyframes"));
  const auto absorbing = [&](std::vector<std::int32_t> ids) {
    return problem([&](GraphChange& change) { change.absorbed = ids; });
  };
  EXPECT_TRUE(testing::contains(absorbing({44}), "before its time")) << "it is estimated";
  EXPECT_TRUE(testing::contains(absorbing({4000}), "before its time")) << "nobody knows it";
  EXPECT_TRUE(testing::contains(absorbing({3, 1}), "not in order"));
  EXPECT_TRUE(testing::contains(absorbing({0, 1, 2, 3}), "a loop ends at")) << "of one that is estimated";
  EXPECT_TRUE(
      testing::contains(problem([](GraphChange& change) { change.state.absorbed_loops = 1'000; }), "more loops went"));
  EXPECT_TRUE(
      testing::contains(problem([](GraphChange& change) { change.state.absorbed_loops = -1; }), "more loops went"));
}

TEST(SmootherJournalRecords, HoldWhatTheFrontEndKnowsOfItsDrift) {
  // A loop that is 4 m off contradicts the steps of the odometry, but not a front end that says it has drifted.
  const auto verdict = [](double drift_variance, bool killed) {
    const testing::Drive drive = testing::make_drive({.keyframes = 26});
    Smoother smoother{BackendConfig(), LoopGates()};
    Records records;
    for (Keyframe keyframe : drive.keyframes) {
      keyframe.covariance.diagonal().segment<3>(kPosition).array() += drift_variance * keyframe.id;
      EXPECT_TRUE(smoother.add_keyframe(keyframe).accepted());
      records.push_back(smoother.take_change());
    }
    if (killed) smoother = restored(records).smoother;
    Pose error;
    error.translation.x() = 4.0;
    return smoother
        .add_loop({25, 2, drive.T_world_body[2].inverse() * drive.T_world_body[25] * error, 1e4 * Matrix6d::Identity()})
        .loop->reason;
  };
  EXPECT_EQ(verdict(0.0, false), LoopReason::kContradictsOdometry);
  EXPECT_EQ(verdict(0.25, false), LoopReason::kNeedsSupport);
  EXPECT_EQ(verdict(0.25, true), LoopReason::kNeedsSupport);
}

TEST(SmootherJournalRecords, HoldWhatChangedAndNothingElse) {
  const testing::Drive drive = testing::make_drive({.seed = 4, .keyframes = 50});
  BackendConfig config;
  config.use_loop_closing = false;
  Smoother smoother(config, LoopGates());
  std::vector<std::size_t> sizes;
  for (const Keyframe& keyframe : drive.keyframes) {
    static_cast<void>(smoother.add_keyframe(keyframe));
    sizes.push_back(smoother.take_change().size());
  }
  EXPECT_LT(sizes.back(), 12'000U) << "bytes of the last of 50 keyframes without a cloud";
  EXPECT_LT(smoother.take_change().size(), 200U) << "when nothing has happened";
}

TEST(SmootherJournalRecords, DoNotGrowWithTheLoopsInTheGraph) {
  const testing::Drive drive = testing::make_drive({.seed = 6, .keyframes = 120});
  BackendConfig config;
  config.use_loop_closing = false;
  Smoother smoother(config, LoopGates());
  std::mt19937 random(6);
  for (const Keyframe& keyframe : drive.keyframes) {
    static_cast<void>(smoother.add_keyframe(keyframe));
    if (keyframe.id >= 12) static_cast<void>(smoother.add_loop(random_loop(drive, keyframe.id, true, random)));
  }
  ASSERT_GE(smoother.stats().loops_kept, 80);
  static_cast<void>(smoother.take_change());
  const std::size_t before = smoother.take_change().size();
  const PoseGraph graph = smoother.pose_graph();
  const PoseGraphEdge& loop = graph.edges.back();
  ASSERT_TRUE(loop.is_loop);
  static_cast<void>(smoother.withdraw_loop(loop.to, loop.from));
  std::optional<GraphChange> change = decode_change(smoother.take_change());
  ASSERT_TRUE(change);
  EXPECT_EQ(change->loops.removed.size(), 1U);
  EXPECT_TRUE(change->loops.altered.empty() && change->loops.appended.empty());
  EXPECT_LT(before, 200U);
}

TEST(SmootherJournalRecords, SixHundredKeyframesAreBackWithinTwoSeconds) {
  const testing::Drive drive = testing::make_drive({.seed = 5, .keyframes = 600});
  BackendConfig config;
  config.use_loop_closing = false;
  Smoother smoother(config, LoopGates());
  Records records;
  for (const Keyframe& keyframe : drive.keyframes) {
    static_cast<void>(smoother.add_keyframe(keyframe));
    records.push_back(smoother.take_change());
  }
  const auto began = std::chrono::steady_clock::now();
  const SmootherRestoration restoration = restored(records, config);
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - began;
  RecordProperty("seconds", std::to_string(spent.count()));
  EXPECT_LT(spent.count(), 2.0);
  expect_same(smoother, restoration.smoother);
}

TEST(GraphChange, IsRefusedWhenANewKeyframeHasNoEstimateButAnotherHasTwo) {
  BackendConfig config;
  config.use_loop_closing = false;
  Smoother smoother(config, LoopGates());
  for (const Keyframe& keyframe : testing::make_drive({.seed = 1, .keyframes = 2}).keyframes) {
    ASSERT_TRUE(smoother.add_keyframe(keyframe).accepted());
  }
  std::optional<GraphChange> change = decode_change(smoother.take_change());
  ASSERT_TRUE(change && change->linearised.size() == 2);
  change->linearised[1].id = change->linearised[0].id;
  RestoredGraph graph{BackendConfig()};
  EXPECT_EQ(graph.apply(std::move(*change)), "a new keyframe has no estimate");
  EXPECT_TRUE(graph.state.nodes.empty());
}

}  // namespace
}  // namespace ignis
