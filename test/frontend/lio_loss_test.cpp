// SPDX-License-Identifier: Apache-2.0
//
// What makes the odometry lose its place, and that it says so.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "frontend/fault_drive.h"

namespace ignis {
namespace {

using test::Drive;
using test::drive;
using test::Watched;

/// Goes through a front end's state as a checkpoint does, and on the way sets a variance of one of its covariances.
struct Spoiler {
  int which;  ///< of the covariances on the way
  double variance;
  int met = 0;

  void number(auto& /*value*/) {}
  void text(auto& /*value*/) {}
  void maybe(auto& /*value*/) {}
  void list(auto& /*values*/) {}
  void matrix(auto& /*values*/) {}
  void matrix(ErrorCovariance& covariance) {
    if (met++ == which) covariance(kPosition, kPosition) = variance;
  }
};

/// The last two covariances are the filter's: 1 is the one that corrections use, 0 the published one.
void spoil(Lio& lio, int from_the_end, double variance) {
  Spoiler counter{.which = -1, .variance = 0.0};
  transfer(counter, lio);
  Spoiler spoiler{.which = counter.met - 1 - from_the_end, .variance = variance};
  transfer(spoiler, lio);
}

void expect_found_again(const Watched& run) {
  EXPECT_EQ(run.trust.back().second, Trust::kOk) << run.lio.status().reason;
  EXPECT_NE(run.lio.status().reason.find("found again"), std::string::npos) << run.lio.status().reason;
  const auto keyframe =
      std::ranges::find_if(run.scans, [](const ScanResult& r) { return r.keyframe && r.keyframe->session > 0; });
  ASSERT_NE(keyframe, run.scans.end());
  EXPECT_EQ(keyframe->keyframe->id, 0) << "keyframes of the new session begin anew";
}

TEST(Fault_F11, BeingCarriedElsewhereIsALossANewSessionAndAFind) {
  // From one scan on all ranges are 6 % too long: nothing fits the old map, but the new scans fit one another.
  Drive input = drive();
  for (std::size_t i = 160; i < input.scans.size(); ++i) {
    for (ScanPoint& point : input.scans[i].points) point.position *= 1.06F;
  }
  for (const FrontendConfig& config : {FrontendConfig{}, test::tuned_config()}) {
    const Watched run(input, config);
    const auto lost = std::ranges::find(run.trust, Trust::kLost, [](const auto& each) { return each.second; });
    ASSERT_NE(lost, run.trust.end());
    EXPECT_LE(lost - run.trust.begin(), 160 + 21) << "within a second";
    EXPECT_GE(run.lio.session(), 1);
    expect_found_again(run);
  }
}

TEST(Fault_F11, AFilterThatBreaksIsALossANewSessionAndAFind) {
  constexpr std::ptrdiff_t kAt = 160;
  for (const int which : {0, 1}) {
    for (const double variance : {-1e-4, 1e-12, std::nan("")}) {
      const auto spoil_once = [&](Lio& lio, std::size_t scan) {
        if (scan == kAt) spoil(lio, which, variance);
      };
      const Watched run(drive(), test::tuned_config(), [](Lio&) {}, spoil_once);
      EXPECT_EQ(run.trust[kAt - 1].second, Trust::kOk);
      EXPECT_EQ(run.trust[kAt + 1].second, Trust::kLost) << "a scan waits for the sample that follows it";
      EXPECT_EQ(run.lio.session(), 1);
      expect_found_again(run);
      for (const ScanResult& scan : run.scans) {
        if (!scan.has_state) continue;
        EXPECT_TRUE(scan.state.T_odom_body.all_finite() && scan.covariance.allFinite());
      }
      EXPECT_LT(run.error_at_end(), 0.2) << "the IMU led on from the last sound state";
    }
  }
}

TEST(Fault_F6, ScansThatComeNoMoreAreToldWhileTheImuGoesOn) {
  Lio lio(test::tuned_config());
  const Drive& input = drive();
  auto imu = input.imu.begin();
  const Utime last = input.scans[159].end_utime();
  for (const Scan& scan : input.scans) {
    while (imu->utime <= scan.end_utime()) (void)lio.add_imu(*imu++);
    (void)lio.add_scan(scan);
    if (scan.end_utime() == last) break;
  }
  ASSERT_EQ(lio.status().trust, Trust::kOk) << lio.status().reason;
  const auto go_on_until = [&](double seconds) {
    while (imu->utime <= last + to_micros(seconds)) (void)lio.add_imu(*imu++);
  };
  go_on_until(0.6);
  EXPECT_EQ(lio.status().trust, Trust::kDegraded);
  EXPECT_NE(lio.status().reason.find("no scan for 0.6 s"), std::string::npos) << lio.status().reason;
  go_on_until(2.1);
  EXPECT_EQ(lio.status().trust, Trust::kLost);
}

}  // namespace
}  // namespace ignis
