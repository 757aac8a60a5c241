// SPDX-License-Identifier: Apache-2.0
#include "frontend/trust/trust_monitor.h"

#include <gtest/gtest.h>

namespace ignis {
namespace {

/// A monitor that sees IMU and scans go by at 20 Hz.
class Feed {
 public:
  TrustMonitor monitor{FrontendConfig{}};
  bool imu = true;
  ScanEvidence evidence;

  Feed() {
    evidence.stats.reason = ScanReason::kApplied;
    evidence.position_sigma = 0.01;
    evidence.acceleration_sigma = 0.05;
    run(20);
  }

  void run(int scans) {
    for (int i = 0; i < scans; ++i) {
      now_ += 50'000;
      if (imu) monitor.note_imu(now_);
      evidence.stats.utime = now_;
      monitor.note_scan(evidence);
    }
  }

  void run_without_scans(double seconds) {
    for (const Utime end = now_ + to_micros(seconds); now_ < end;) monitor.note_imu(now_ += 4'000);
  }

 private:
  Utime now_ = 1'000'000'000;
};

void expect(const TrustMonitor& monitor, Trust trust, const std::string& words) {
  EXPECT_EQ(monitor.trust_now(), trust);
  EXPECT_NE(monitor.reason().find(words), std::string::npos) << monitor.reason();
}

/// Nine scans that fit do not end what awaits ten of them; the tenth does.
void expect_until_ten_fit(Feed& feed, Trust trust, const std::string& words, const std::string& then = "OK") {
  feed.run(9);
  expect(feed.monitor, trust, words);
  feed.run(1);
  expect(feed.monitor, Trust::kOk, then);
}

TEST(TrustMonitor, IsOkWhileScansAgree) {
  const Feed feed;
  expect(feed.monitor, Trust::kOk, "OK");
}

TEST(TrustMonitor, IsDegradedUntilTenScansBearOutWhatWasTakenBack) {
  Feed feed;
  feed.monitor.note_contradiction();
  expect_until_ten_fit(feed, Trust::kDegraded, "scans took back a velocity that the IMU is sure of");
}

TEST(TrustMonitor, FiveScansWithoutACorrectionDegradeAndTwoSecondsLose) {
  Feed feed;
  feed.evidence.stats.reason = ScanReason::kTooFewMatches;
  feed.run(4);
  EXPECT_EQ(feed.monitor.trust(), Trust::kOk);
  feed.run(1);
  expect(feed.monitor, Trust::kDegraded, "too few points found a plane");
  feed.run(36);
  expect(feed.monitor, Trust::kLost, "no scan applied");
}

TEST(TrustMonitor, ScansThatFitAgainAfterALossFindThePlaceOnlyOnceTenOfThemAgree) {
  Feed feed;
  feed.evidence.stats.reason = ScanReason::kTooFewMatches;
  feed.run(41);
  feed.evidence.stats.reason = ScanReason::kApplied;
  expect_until_ten_fit(feed, Trust::kLost, "no scan had fitted for 2 s (1 applied scans to go)");
}

TEST(TrustMonitor, ScansThatComeNoMoreDegradeAndTwoSecondsWithoutThemLose) {
  Feed feed;
  feed.run_without_scans(0.4);
  expect(feed.monitor, Trust::kOk, "OK");
  feed.run_without_scans(0.2);
  expect(feed.monitor, Trust::kDegraded, "no scan for 0.6 s, going on with the IMU alone");
  feed.run(1);
  expect(feed.monitor, Trust::kOk, "OK");
  feed.run_without_scans(2.1);
  expect(feed.monitor, Trust::kLost, "no scan for 2.1 s");
  expect_until_ten_fit(feed, Trust::kLost, "no scan had fitted for 2 s (1 applied scans to go)");
}

TEST(TrustMonitor, ScansThatAreSeldomAreNotSilent) {
  Feed feed;
  for (int i = 0; i < 5; ++i) {
    feed.run_without_scans(0.8);
    if (i > 1) expect(feed.monitor, Trust::kOk, "OK");  // by then it is known how often they come
    feed.run(1);
  }
}

TEST(TrustMonitor, ALossOutlivesASilenceOfBothStreams) {
  Feed feed;
  feed.run_without_scans(3.0);
  feed.monitor.note_resumption();
  expect_until_ten_fit(feed, Trust::kLost, "no scan had fitted for 2 s (1 applied scans to go)");
}

TEST(TrustMonitor, ScansThatLieInTheirPlanesLessWellThanBeforeConfirmNoPlace) {
  Feed feed;
  feed.evidence.stats.mean_residual = 0.008;
  feed.run(100);
  feed.monitor.note_resumption();
  feed.evidence.stats.mean_residual = 0.016;
  feed.run(100);
  EXPECT_TRUE(feed.monitor.awaits_confirmation());
  feed.evidence.stats.mean_residual = 0.010;
  expect_until_ten_fit(feed, Trust::kDegraded, "resumed");
  EXPECT_FALSE(feed.monitor.awaits_confirmation());
}

TEST(TrustMonitor, WhatIsSaidOfAScanDoesNotDependOnHowFarTheSamplesAreAhead) {
  Feed feed;
  feed.run_without_scans(1.0);
  EXPECT_EQ(feed.monitor.trust(), Trust::kOk);
  expect(feed.monitor, Trust::kDegraded, "no scan for 1.0 s");
}

TEST(TrustMonitor, ARefusedScanNowAndThenDoesNotHideThatNoneFits) {
  Feed feed;
  feed.evidence.stats.reason = ScanReason::kTooFewMatches;
  for (int i = 0; i < 2; ++i) {
    feed.run_without_scans(1.0);
    feed.run(1);
  }
  EXPECT_EQ(feed.monitor.trust(), Trust::kLost) << feed.monitor.reason();
}

TEST(TrustMonitor, APoseThatIsNotKnownIsNotOk) {
  Feed feed;
  feed.evidence.position_sigma = 0.2;
  feed.run(1);
  expect(feed.monitor, Trust::kDegraded, "position sigma 0.20 m");
  feed.evidence.position_sigma = 1.1;
  feed.run(1);
  EXPECT_EQ(feed.monitor.trust(), Trust::kLost);
}

TEST(TrustMonitor, AmongThingsThatMoveThePoseIsNotOk) {
  Feed feed;
  feed.evidence.restless = true;
  feed.run(1);
  expect(feed.monitor, Trust::kDegraded, "most of what faces along the way moves");
  feed.evidence.restless = false;
  feed.run(1);
  expect(feed.monitor, Trust::kOk, "OK");
}

TEST(TrustMonitor, APoseThatCameOffOnTheWayIsNotOkThoughTheMapHoldsIt) {
  Feed feed;
  feed.evidence.sigma_since_start = 0.6;
  feed.run(100);
  expect(feed.monitor, Trust::kDegraded, "position sigma since the start 0.60 m (limit 0.15)");
}

TEST(TrustMonitor, WhatEveryDriveGathersByAndByIsNoReasonForDoubt) {
  Feed feed;
  for (int metre = 1; metre <= 2000; ++metre) {
    feed.evidence.position.z() = -metre;
    feed.evidence.sigma_since_start = 1.5e-4 * metre;
    feed.run(1);
    ASSERT_EQ(feed.monitor.trust(), Trust::kOk) << metre;
  }
}

TEST(TrustMonitor, StandingIsNoWay) {
  Feed feed;
  feed.evidence.sigma_since_start = 0.2;
  for (int i = 0; i < 20'000; ++i) {
    feed.evidence.position.x() = i % 2 == 0 ? 0.0 : 0.1;
    feed.run(1);
  }
  EXPECT_EQ(feed.monitor.trust(), Trust::kDegraded);
}

TEST(TrustMonitor, ASilentImuDegradesWithin100MsAndIsForgivenTenScansAfterItsReturn) {
  Feed feed;
  feed.imu = false;
  feed.run(2);
  EXPECT_EQ(feed.monitor.trust(), Trust::kOk) << "100 ms";
  feed.run(1);
  expect(feed.monitor, Trust::kDegraded, "no IMU data for 0.1 s");
  feed.imu = true;
  feed.run(9);
  expect(feed.monitor, Trust::kDegraded, "IMU data are back");
  feed.run(1);
  EXPECT_EQ(feed.monitor.trust(), Trust::kOk);
}

TEST(TrustMonitor, ALossIsAnnouncedAndSoIsBeingFoundAgain) {
  Feed feed;
  feed.monitor.note_loss("scans contradicted the map, a new one was begun");
  expect_until_ten_fit(feed, Trust::kLost, "a new one was begun", "found again after 1 loss");
}

TEST(TrustMonitor, ScansThatKeepTakingTheVelocityAwayAreContradictedByTheImu) {
  Feed feed;
  // The vehicle accelerates at 1.5 m/s^2 among returns that move with it.
  feed.evidence.velocity_correction = {0.0, 0.0, 0.075};
  feed.run(45);
  expect(feed.monitor, Trust::kDegraded, "disagree");
  EXPECT_GT(feed.monitor.disagreement(), 8.0);
}

TEST(TrustMonitor, AStartThatScansSawMovingIsOkAfterFortyOfThem) {
  Feed feed;
  feed.monitor.note_uncertain_start("scans say that it was moving", 40);
  feed.run(39);
  expect(feed.monitor, Trust::kDegraded, "moving, 1 applied scans to go");
  feed.run(1);
  expect(feed.monitor, Trust::kOk, "OK");
}

TEST(TrustMonitor, AStartThatTheImuContradictsSaysSo) {
  Feed feed;
  feed.monitor.note_uncertain_start("scans do not tell whether it stood", 60);
  feed.evidence.velocity_correction = {0.0, 0.0, 0.075};
  feed.run(45);
  expect(feed.monitor, Trust::kDegraded, "scan motion and IMU motion disagree");
}

TEST(TrustMonitor, CorrectionsThatCancelOutAreNoContradiction) {
  Feed feed;
  for (int i = 0; i < 60; ++i) {
    feed.evidence.velocity_correction = Eigen::Vector3d(0.0, 0.0, i % 2 == 0 ? 0.075 : -0.075);
    feed.run(1);
  }
  EXPECT_EQ(feed.monitor.trust(), Trust::kOk);
}

}  // namespace
}  // namespace ignis
