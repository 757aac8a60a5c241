// SPDX-License-Identifier: Apache-2.0
//
// What holds after any sequence of keyframes, good, bad, doubled or missing, and of loops and commands.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <tuple>

#include "backend/smoother.h"
#include "backend/synthetic_drive.h"

namespace ignis {
namespace {

using Generator = std::mt19937;

int up_to(int largest, Generator& generator) { return std::uniform_int_distribution(0, largest)(generator); }

/// A smoother, what was put into it, and what it must never do.
class Watched {
 public:
  Watched(testing::Drive drive, int estimated_keyframes)
      : drive_(std::move(drive)), smoother_(retiring_beyond(estimated_keyframes), LoopGates()) {}

  [[nodiscard]] bool finished() const { return smoother_.expected_id() >= std::ssize(drive_.keyframes); }
  [[nodiscard]] int refused() const { return refused_; }
  [[nodiscard]] int loops() const { return loops_; }

  /// Any keyframe: mostly the next one, else an earlier or a later one, now and then spoilt.
  void put_keyframe(Generator& generator) {
    const int last = static_cast<int>(std::ssize(drive_.keyframes)) - 1;
    const int chosen = up_to(9, generator) < 7 ? smoother_.expected_id() : up_to(last, generator);
    Keyframe keyframe = drive_.keyframes[static_cast<std::size_t>(std::min(chosen, last))];
    const int fault = up_to(19, generator);
    if (fault == 0) keyframe.state.T_odom_body.translation.x() = std::nan("");
    if (fault == 1) keyframe.state.T_odom_body.translation.z() += 1e5;
    if (fault == 2) keyframe.session += 1;
    if (fault == 3) keyframe.imu_complete = false;
    if (fault == 4) keyframe.imu.clear();
    const std::size_t before = smoother_.all_poses().size();
    const SmootherUpdate update = smoother_.add_keyframe(keyframe);
    if (update.accepted()) {
      EXPECT_TRUE(accepted_.insert(keyframe.id).second) << "id " << keyframe.id << " was used before";
      EXPECT_EQ(update.revision, revision_ + 1);
    } else {
      ++refused_;
      EXPECT_FALSE(update.reason.empty()) << "a refusal has a reason";
      EXPECT_EQ(smoother_.all_poses().size(), before);
    }
    check(update);
  }

  /// A loop between any two ids, true or not, sound or not; or a command about one.
  void put_loop(Generator& generator) {
    const auto count = static_cast<int>(smoother_.all_poses().size());
    const int from = up_to(count, generator) - 1;
    const int to = up_to(count, generator) - 1;
    const int kind = up_to(5, generator);
    if (kind == 0) return check(smoother_.withdraw_loop(from, to));
    if (kind == 1) return check(smoother_.veto_loop(from, to));
    LoopMeasurement loop{from, to, {}, 1e4 * Matrix6d::Identity()};
    if (from >= 0 && to >= 0) {
      const auto& truth = drive_.T_world_body;
      loop.T_to_from = truth[static_cast<std::size_t>(to)].inverse() * truth[static_cast<std::size_t>(from)];
    }
    if (kind == 2) loop.T_to_from.translation.x() += 3.0;
    if (kind == 3) loop.information(2, 2) = std::nan("");
    const SmootherUpdate update = smoother_.add_loop(loop);
    ASSERT_TRUE(update.loop) << "a loop is answered";
    EXPECT_TRUE(update.loop->accepted() || !update.loop->reason_text.empty()) << "a refusal has a reason";
    loops_ += update.loop->accepted() ? 1 : 0;
    check(update);
  }

 private:
  static BackendConfig retiring_beyond(int estimated_keyframes) {
    BackendConfig config;
    config.estimated_keyframes = estimated_keyframes;
    return config;
  }

  void check(const SmootherUpdate& update) {
    EXPECT_GE(update.revision, revision_) << "revisions only increase";
    EXPECT_LE(update.revision, revision_ + 1);
    EXPECT_GE(update.expected_id, expected_id_);
    revision_ = update.revision;
    expected_id_ = update.expected_id;
    const auto retired = static_cast<std::size_t>(smoother_.stats().retired);
    ASSERT_GE(retired, known_.size()) << "what has retired stays retired";
    for (std::size_t i = 0; i < known_.size(); ++i) {
      EXPECT_EQ(smoother_.all_poses()[i].T_map_body.translation, known_[i]) << "and stays where it is";
    }
    for (std::size_t i = known_.size(); i < retired; ++i)
      known_.push_back(smoother_.all_poses()[i].T_map_body.translation);
    std::set<std::int32_t> ids;
    for (const KeyframePose& pose : smoother_.all_poses()) {
      EXPECT_TRUE(ids.empty() || pose.id > *ids.rbegin()) << "ids ascend";
      ids.insert(pose.id);
      ASSERT_TRUE(pose.T_map_body.all_finite());
    }
    EXPECT_EQ(ids, accepted_) << "every accepted keyframe is in the graph, and no other";
    if (update.covariance_valid) {
      const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(update.covariance);
      EXPECT_GT(eigen.eigenvalues().minCoeff(), 0.0) << "the covariance is positive definite";
    }
  }

  testing::Drive drive_;
  Smoother smoother_;
  std::set<std::int32_t> accepted_;
  std::vector<Eigen::Vector3d> known_;  ///< positions of those that have retired
  std::int32_t revision_ = 0;
  std::int32_t expected_id_ = 0;
  int refused_ = 0;
  int loops_ = 0;
};

/// Seed, and keyframes that are estimated at most.
class SmootherInvariants : public ::testing::TestWithParam<std::tuple<unsigned, int>> {};

TEST_P(SmootherInvariants, HoldAfterAnySequence) {
  const auto [seed, estimated_keyframes] = GetParam();
  Generator generator(seed);
  Watched watched(testing::make_drive({.seed = seed, .keyframes = 45}), estimated_keyframes);
  for (int step = 0; step < 400 && !watched.finished(); ++step) {
    if (up_to(3, generator) > 0) {
      watched.put_keyframe(generator);
    } else {
      watched.put_loop(generator);
    }
    if (HasFatalFailure()) return;
  }
  EXPECT_TRUE(watched.finished());
  EXPECT_GT(watched.refused(), 0) << "the sequence had no fault";
  EXPECT_GT(watched.loops(), 0) << "the sequence had no loop";
}

INSTANTIATE_TEST_SUITE_P(Seeds, SmootherInvariants,
                         ::testing::Combine(::testing::Range(1U, 9U), ::testing::Values(1000, 20)));

}  // namespace
}  // namespace ignis
