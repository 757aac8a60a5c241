// SPDX-License-Identifier: Apache-2.0
#include "frontend/scan_matcher.h"

#include <limits>

#include <gtest/gtest.h>

#include "frontend/standing_sensor.h"

namespace ignis {
namespace {

class ScanMatcherTest : public ::testing::Test {
 protected:
  ScanMatcherTest() { predicted_.covariance = 1e-4 * Matrix15d::Identity(); }

  [[nodiscard]] MatchResult match() const {
    return ScanMatcher(config_).match(predicted_, predicted_.nominal.T_odom_body, standing_.newest, standing_.map);
  }

  test::StandingSensor standing_;
  FrontendConfig config_ = standing_.config;
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
