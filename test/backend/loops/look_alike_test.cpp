// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "backend/slipped_drive.h"
#include "backend/smoother.h"

/// Places that look alike, once odometry does not know any more where it is, and says so.
namespace ignis {
namespace {

constexpr double kWrongM = 0.5;

/// Sigma of a blind step, such that a slip of tens of metres is no surprise.
BackendConfig honest() {
  BackendConfig config;
  config.loose_position_m = 15.0;
  return config;
}

struct Loops {
  int right = 0;
  int wrong = 0;
  int waited = 0;  ///< for support
  std::string said;
};

Loops loops_of(const testing::Drive& drive, const BackendConfig& config) {
  Smoother smoother(config, LoopGates());
  Loops loops;
  for (const Keyframe& keyframe : drive.keyframes) {
    const SmootherUpdate update = smoother.add_keyframe(keyframe);
    EXPECT_TRUE(update.accepted()) << update.reason;
    loops.said += update.loop->reason_text + '\n';
    loops.waited += update.loop->reason == LoopReason::kNeedsSupport ? 1 : 0;
  }
  for (const PoseGraphEdge& edge : smoother.pose_graph().edges) {
    if (!edge.is_loop) continue;
    const Pose T_true = drive.T_world_body[static_cast<std::size_t>(edge.from)].inverse() *
                        drive.T_world_body[static_cast<std::size_t>(edge.to)];
    const double off = body_difference(T_true, edge.T_from_to).tail<3>().norm();
    ++(off > kWrongM ? loops.wrong : loops.right);
  }
  return loops;
}

/// The second hall lies 45 m beside the first one, and odometry places it on the first to within decimetres.
testing::Drive drive_through_two_halls(unsigned seed) {
  testing::SlipOptions options{.seed = seed};
  options.second_hall = {0.0, 0.0, -45.0};
  options.slip = {0.3, 0.0, 45.2};
  return testing::make_slipped_drive(options);
}

TEST(LookAlike, PlacesAreNotTakenForOneAnotherWhereOdometryHasSlipped) {
  int believed = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const testing::Drive drive = drive_through_two_halls(seed);
    const Loops loops = loops_of(drive, honest());
    EXPECT_EQ(loops.wrong, 0) << "seed " << seed << '\n' << loops.said;
    EXPECT_GE(loops.waited, 3) << "the halls must look alike\n" << loops.said;
    BackendConfig any_support = honest();
    any_support.loop_support_apart_m = 0.0;
    believed += loops_of(drive, any_support).wrong;
  }
  EXPECT_GE(believed, 10) << "what the distance keeps out";
}

TEST(LookAlike, AHallIsKnownAgainOnceItsFarSideAgrees) {
  int closed_early = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    testing::SlipOptions options{.seed = seed, .speed = 2.0, .turn_rate = 0.2, .keyframes = 16};
    options.slip = {-0.4, 0.0, 0.9};
    const testing::Drive drive = testing::make_slipped_drive(options);
    const Loops loops = loops_of(drive, honest());
    EXPECT_GE(loops.right, 5) << "seed " << seed << '\n' << loops.said;
    EXPECT_EQ(loops.wrong, 0);
    testing::Drive early = drive;
    early.keyframes.resize(28);  // 11 m beyond where the second lap began
    closed_early += loops_of(early, honest()).right;
  }
  EXPECT_EQ(closed_early, 0);
}

}  // namespace
}  // namespace ignis
