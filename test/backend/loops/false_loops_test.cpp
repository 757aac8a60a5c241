// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <random>

#include "backend/smoother.h"
#include "backend/synthetic_drive.h"
#include "process_cost.h"
#include "slow_build.h"

/// Many laps with true loops and wrong ones among them. Run by hand, the tests print their tables.
namespace ignis {
namespace {

constexpr int kKeyframes = 110;
constexpr int kLap = 21;
constexpr double kLoopSigmaM = 0.02;
constexpr double kLoopSigmaRad = 0.003;
constexpr double kMostHandlingMs = 100.0 * test::kBuildSlowdown;  // of 99 % of the keyframes

Matrix6d loop_information() {
  Vector6d diagonal;
  diagonal << Eigen::Vector3d::Constant(1.0 / (kLoopSigmaRad * kLoopSigmaRad)),
      Eigen::Vector3d::Constant(1.0 / (kLoopSigmaM * kLoopSigmaM));
  return diagonal.asDiagonal();
}

Vector6d gaussian(std::mt19937& random, double rotation, double position) {
  std::normal_distribution<double> unit;
  Vector6d v;
  for (int i = 0; i < 6; ++i) v(i) = unit(random) * (i < 3 ? rotation : position);
  return v;
}

Pose true_loop(const testing::Drive& drive, int from, int to) {
  return drive.T_world_body[static_cast<std::size_t>(to)].inverse() *
         drive.T_world_body[static_cast<std::size_t>(from)];
}

struct Outcome {
  double error_m = 0.0;
  /// Processor time of a keyframe with one of its loops, for each loop: on the vehicle a keyframe closes one at most.
  std::vector<double> handling_ms;
  int true_tried = 0;
  int true_kept = 0;
  int wrong_tried = 0;
  int wrong_kept = 0;
};

/// How wrong loops relate to one another.
enum class Lies {
  kIndependent,  ///< each wrong in its own way by a few decimetres up to several metres
  kGroups,       ///< 20 in a row wrong by the same 3 m, as where one of two parallel aisles is taken for the other
};

/// Where the vehicle would stand according to the group that keyframe `i` belongs to.
Pose beside(const testing::Drive& drive, int i) {
  const double bearing = 1.3 * (i / 40);
  Pose shift;
  shift.translation = {3.0 * std::cos(bearing), 0.0, 3.0 * std::sin(bearing)};
  return shift * drive.T_world_body[static_cast<std::size_t>(i)];
}

/// A true loop at every second keyframe from the second lap on, and before it wrong ones, so often that these are
/// `wrong_share` of all.
Outcome drive_laps(unsigned seed, double wrong_share, Lies lies) {
  const testing::Drive drive = testing::make_drive({.seed = seed, .keyframes = kKeyframes});
  BackendConfig config;
  config.use_loop_closing = false;
  Smoother smoother(config, LoopGates());
  std::mt19937 noise(seed);
  std::mt19937 choice(seed + 1000U);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Outcome outcome;
  double keyframe_ms = 0.0;
  const auto add_loop = [&](const LoopMeasurement& loop) {
    const double began = bench::processor_ms();
    static_cast<void>(smoother.add_loop(loop));
    outcome.handling_ms.push_back(keyframe_ms + bench::processor_ms() - began);
  };
  const auto close_loops = [&](int i) {
    const Pose T_measured =
        perturbed_in_body(true_loop(drive, i, i - kLap), gaussian(noise, kLoopSigmaRad, kLoopSigmaM));
    for (double lies_left = wrong_share / (1.0 - wrong_share); unit(choice) < lies_left; lies_left -= 1.0) {
      int to = static_cast<int>(unit(choice) * (i - 10));
      const double size_m = 0.3 * std::pow(20.0, unit(choice));
      Pose T_wrong = perturbed_in_body(true_loop(drive, i, to), gaussian(choice, 0.1 * size_m, size_m));
      if (lies == Lies::kGroups) {
        to = i - kLap + 1;
        T_wrong = perturbed_in_body(drive.T_world_body[static_cast<std::size_t>(to)].inverse() * beside(drive, i),
                                    gaussian(choice, kLoopSigmaRad, kLoopSigmaM));
      }
      add_loop({i, to, T_wrong, loop_information()});
      ++outcome.wrong_tried;
    }
    add_loop({i, i - kLap, T_measured, loop_information()});
    ++outcome.true_tried;
  };
  for (int i = 0; i < kKeyframes; ++i) {
    const double began = bench::processor_ms();
    EXPECT_TRUE(smoother.add_keyframe(drive.keyframes[static_cast<std::size_t>(i)]).accepted());
    keyframe_ms = bench::processor_ms() - began;
    if (i > kLap && i % 2 == 0) {
      close_loops(i);
    } else {
      outcome.handling_ms.push_back(keyframe_ms);
    }
  }
  std::vector<Pose> poses;
  for (const KeyframePose& pose : smoother.all_poses()) poses.push_back(pose.T_map_body);
  outcome.error_m = testing::position_error(poses, drive.T_world_body);
  for (const PoseGraphEdge& edge : smoother.pose_graph().edges) {
    if (!edge.is_loop) continue;
    const double off = body_difference(true_loop(drive, edge.to, edge.from), edge.T_from_to).tail<3>().norm();
    ++(off < 6.0 * kLoopSigmaM ? outcome.true_kept : outcome.wrong_kept);
  }
  return outcome;
}

void expect_no_harm(Lies lies, const std::vector<double>& shares) {
  constexpr unsigned kSeeds = 3;
  double clean = 0.0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) clean += drive_laps(seed, 0.0, lies).error_m / kSeeds;
  std::printf("wrong share   ATE [m]   of clean   true kept   wrong kept   p99 of a keyframe\n");
  for (const double share : shares) {
    Outcome sum;
    for (unsigned seed = 1; seed <= kSeeds; ++seed) {
      const Outcome outcome = drive_laps(seed, share, lies);
      sum.error_m += outcome.error_m / kSeeds;
      sum.true_tried += outcome.true_tried;
      sum.true_kept += outcome.true_kept;
      sum.wrong_tried += outcome.wrong_tried;
      sum.wrong_kept += outcome.wrong_kept;
      sum.handling_ms.insert(sum.handling_ms.end(), outcome.handling_ms.begin(), outcome.handling_ms.end());
    }
    const double p99_ms = bench::quantile(sum.handling_ms, 0.99);
    std::printf("%10.0f %%   %7.4f   %8.3f   %4d of %d   %4d of %d   %.1f ms\n", 100.0 * share, sum.error_m,
                sum.error_m / clean, sum.true_kept, sum.true_tried, sum.wrong_kept, sum.wrong_tried, p99_ms);
    EXPECT_LT(sum.error_m, 1.05 * clean);
    EXPECT_GE(sum.true_kept, 0.97 * sum.true_tried);
    EXPECT_EQ(sum.wrong_kept, 0);
    EXPECT_LT(p99_ms, kMostHandlingMs);
  }
}

TEST(FalseLoops, LeaveTheTrajectoryAsItWouldBeWithoutThem) {
  expect_no_harm(Lies::kIndependent, {0.01, 0.03, 0.1, 0.3, 0.9});
}

TEST(FalseLoops, ThatAgreeWithEachOtherDoNotEither) { expect_no_harm(Lies::kGroups, {0.1, 0.3, 0.5}); }

/// Mean of the normalised squared error of the newest keyframe's pose over seeds; six for an honest covariance.
double mean_nees(bool with_loops, int keyframes) {
  constexpr unsigned kDrives = 120;
  double sum = 0.0;
  for (unsigned seed = 1; seed <= kDrives; ++seed) {
    const testing::Drive drive = testing::make_drive({.seed = seed, .keyframes = keyframes});
    BackendConfig config;
    config.use_loop_closing = false;
    // The synthetic vehicle begins where it is said to begin and its IMU has no biases.
    config.prior_tilt_deg = 0.01;
    config.prior_yaw_rad = config.prior_position_m = 1e-5;
    config.prior_gyro_bias = 1e-5;
    config.prior_accel_bias = 1e-4;
    config.imu.gyro_bias_walk = 1e-7;
    config.imu.accel_bias_walk = 1e-6;
    Smoother smoother(config, LoopGates());
    std::mt19937 noise(seed);
    SmootherUpdate update;
    for (int i = 0; i < keyframes; ++i) {
      update = smoother.add_keyframe(drive.keyframes[static_cast<std::size_t>(i)]);
      if (!with_loops || i < kLap + 1 || i % 3 != 0) continue;
      const Pose T_measured =
          perturbed_in_body(true_loop(drive, i, i - kLap), gaussian(noise, kLoopSigmaRad, kLoopSigmaM));
      update = smoother.add_loop({i, i - kLap, T_measured, loop_information()});
    }
    const Vector6d error = body_difference(smoother.all_poses().back().T_map_body,
                                           drive.T_world_body[static_cast<std::size_t>(keyframes) - 1]);
    EXPECT_TRUE(update.covariance_valid);
    sum += error.dot(update.covariance.ldlt().solve(error)) / kDrives;
  }
  return sum;
}

TEST(SmoothedPoses, HaveErrorsThatTheirCovarianceBears) {
  // 95 % of the mean of 120 chi-squares with six degrees of freedom lie within 6 +- 0.62.
  const double chain = mean_nees(false, 31);
  const double loops = mean_nees(true, 46);
  std::printf("NEES of the newest pose over 120 drives (6 expected): %.2f without loops, %.2f with\n", chain, loops);
  EXPECT_NEAR(chain, 6.0, 0.62);
  EXPECT_NEAR(loops, 6.0, 0.62);
}

}  // namespace
}  // namespace ignis
