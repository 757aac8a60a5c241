// SPDX-License-Identifier: Apache-2.0
//
// Each gate, tightened until ordinary scans no longer pass, refuses under its own name.

#include <functional>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include "frontend/lio_runner.h"

namespace ignis {
namespace {

using test::LioRun;

const test::Drive& shaken_drive() {
  static const test::Drive drive =
      test::simulate(test::furnished_hall(), test::ellipse_drive(2.0, 6.0, 4.0, 1.3), 5.0, test::Sensors{}, 4);
  return drive;
}

LioRun run_with(const std::function<void(FrontendConfig&)>& change) {
  FrontendConfig config;
  change(config);
  return test::run_lio(config, shaken_drive());
}

TEST(ScanReasons, NameTheGateThatRefused) {
  const auto tight = [](FrontendConfig& config) { config.max_innovation_sigma = 0.5; };
  EXPECT_GT(test::count(run_with([](FrontendConfig&) {}), ScanReason::kMapEmpty), 0) << "the first scan of all";
  const LioRun innovation = run_with([&](FrontendConfig& config) {
    tight(config);
    config.max_mean_innovation = 1e-3;
  });
  EXPECT_GT(test::count(innovation, ScanReason::kInnovationTooLarge), 10);
  const LioRun position = run_with([&](FrontendConfig& config) {
    tight(config);
    config.max_scan_correction_m = 1e-3;
  });
  EXPECT_GT(test::count(position, ScanReason::kCorrectionTooLarge), 0);
  const LioRun velocity = run_with([&](FrontendConfig& config) {
    tight(config);
    config.max_scan_velocity_corr = 1e-3;
  });
  EXPECT_GT(test::count(velocity, ScanReason::kVelocityCorrectionTooLarge), 0);
}

TEST(ScanReasons, EveryRefusedScanHasOneInWords) {
  const LioRun run = run_with([](FrontendConfig& config) { config.max_mean_innovation = 0.012; });
  int refused = 0;
  for (const ScanResult& scan : run.scans) {
    EXPECT_EQ(scan.stats.applied(), scan.stats.reason == ScanReason::kApplied);
    EXPECT_FALSE(explanation(scan.stats).empty());
    refused += scan.stats.applied() ? 0 : 1;
  }
  EXPECT_GT(refused, 0);
}

TEST(Invariants, OdometryNeverJumpsWhereScansAreAppliedAndCovariancesStayPositiveDefinite) {
  const LioRun run = run_with([](FrontendConfig&) {});
  ASSERT_GT(run.states.size(), 500U);
  for (std::size_t i = 1; i < run.states.size(); ++i) {
    const NavState& before = run.states[i - 1];
    const NavState& after = run.states[i];
    ASSERT_GT(after.utime, before.utime);
    const double seconds = seconds_between(before.utime, after.utime);
    const double step = (after.T_odom_body.translation - before.T_odom_body.translation).norm();
    EXPECT_LT(step, 0.05 + 3.0 * seconds) << "a correction is bounded by the trust region";
  }
  std::set<std::int32_t> ids;
  for (const ScanResult& scan : run.scans) {
    if (scan.has_state) {
      EXPECT_GT(scan.covariance.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), 0.0);
    }
    if (scan.keyframe) {
      EXPECT_TRUE(ids.insert(scan.keyframe->id).second) << "an id is used once";
    }
  }
  EXPECT_GE(ids.size(), 2U);
}

}  // namespace
}  // namespace ignis
