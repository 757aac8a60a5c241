// SPDX-License-Identifier: Apache-2.0
#include "frontend/scan_matcher.h"

#include <limits>

#include <gtest/gtest.h>

#include "frontend/lio_runner.h"

namespace ignis {
namespace {

/// A second of scans of the furnished hall from a standing sensor as a map, and one more to match.
class ScanMatcherTest : public ::testing::Test {
 protected:
  ScanMatcherTest() {
    const test::Drive drive =
        test::simulate(test::furnished_hall(), test::straight_drive(10.0, 0.0), 2.0, test::Sensors{}, 3);
    for (std::size_t i = 0; i < 30; ++i) {
      scan_.clear();
      for (const ScanPoint& point : drive.scans[i].points) scan_.push_back(point.position);
      if (i < 29) map_.insert(scan_, Pose(), true);
    }
    predicted_.covariance = 1e-4 * Matrix15d::Identity();
  }

  [[nodiscard]] MatchResult match() const {
    return ScanMatcher(config_).match(predicted_, predicted_.nominal.T_odom_body, scan_, map_);
  }

  FrontendConfig config_ = test::tuned_config();
  LocalMap map_{config_};
  std::vector<Eigen::Vector3f> scan_;
  FilterState predicted_;
};

TEST_F(ScanMatcherTest, AppliesAScanThatFits) { EXPECT_EQ(match().stats.reason, ScanReason::kApplied); }

TEST_F(ScanMatcherTest, SaysSoWhenNoDirectionIsObserved) {
  config_.degeneracy_signal_to_noise = 1000.0;
  config_.degeneracy_threshold = 0.3;
  const MatchResult result = match();
  EXPECT_EQ(result.stats.reason, ScanReason::kUnobservable);
  EXPECT_EQ(result.stats.degenerate_directions, 6);
  EXPECT_EQ(result.filter.covariance, predicted_.covariance) << "the prediction goes on as it is";
}

TEST_F(ScanMatcherTest, ACovarianceThatIsNoNumberIsANumericalFailureAndChangesNothing) {
  predicted_.covariance(kVelocity, kVelocity) = std::numeric_limits<double>::quiet_NaN();
  const MatchResult result = match();
  EXPECT_EQ(result.stats.reason, ScanReason::kNumericalFailure);
  EXPECT_EQ(result.filter.nominal.T_odom_body.translation, predicted_.nominal.T_odom_body.translation);
  EXPECT_TRUE(result.information_body.isZero());
}

}  // namespace
}  // namespace ignis
