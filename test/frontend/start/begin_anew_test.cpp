// SPDX-License-Identifier: Apache-2.0
//
// A command ends the session: nothing of it is left in the next one.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "frontend/fault_drive.h"

namespace ignis {
namespace {

using test::drive;
using test::Drive;

/// Each scan comes when the samples that cover it are there.
std::vector<ScanResult> feed(Lio& lio, const Drive& input) {
  std::vector<ScanResult> results;
  auto scan = input.scans.begin();
  for (const ImuSample& sample : input.imu) {
    std::ranges::move(lio.add_imu(sample).scans, std::back_inserter(results));
    for (; scan != input.scans.end() && scan->end_utime() <= sample.utime; ++scan) {
      std::ranges::move(lio.add_scan(*scan), std::back_inserter(results));
    }
  }
  return results;
}

Drive later(Drive input, Utime by) {
  for (ImuSample& sample : input.imu) sample.utime += by;
  for (Scan& scan : input.scans) scan.utime += by;
  return input;
}

TEST(BeginAnew, EndsTheSessionWithTheFirstSampleBehindTheStampAndKeepsNothing) {
  const Utime last = drive().imu.back().utime;
  // It stands again, elsewhere.
  const Drive second = later(drive(), last - drive().imu.front().utime + 152'000);
  Lio lio(test::tuned_config());
  (void)feed(lio, drive());
  ASSERT_STREQ(lio.begin_anew_after(last + 150'000, 0), "");
  EXPECT_EQ(lio.session(), 0) << "its time has not come";
  const std::vector<ScanResult> results = feed(lio, second);
  EXPECT_EQ(lio.session(), 1);
  EXPECT_EQ(lio.status().trust, Trust::kOk);

  // The sample that ended the session is not part of the next one.
  Drive rest = second;
  rest.imu.erase(rest.imu.begin());
  Lio fresh(test::tuned_config(), 1, "new session");
  const std::vector<ScanResult> expected = feed(fresh, rest);
  ASSERT_EQ(results.size(), expected.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    EXPECT_EQ(results[i].stats.session, 1);
    EXPECT_EQ(results[i].state.T_odom_body.translation, expected[i].state.T_odom_body.translation) << i;
    EXPECT_EQ(results[i].state.T_odom_body.rotation.coeffs(), expected[i].state.T_odom_body.rotation.coeffs()) << i;
    EXPECT_EQ(results[i].state.gyro_bias, expected[i].state.gyro_bias) << i;
    EXPECT_EQ(results[i].covariance, expected[i].covariance) << i;
    EXPECT_EQ(results[i].trust, expected[i].trust) << i;
    EXPECT_EQ(results[i].stats.map_points, expected[i].stats.map_points) << i;
    ASSERT_EQ(results[i].keyframe.has_value(), expected[i].keyframe.has_value()) << i;
    if (results[i].keyframe) {
      EXPECT_EQ(results[i].keyframe->id, expected[i].keyframe->id);
    }
  }
}

/// Verdicts on three scans: of the end, behind it, and of the start of the next session.
std::vector<ScanStats> verdicts_around_the_end(Utime lateness) {
  const Utime last = drive().imu.back().utime;
  const Utime due = last + 200'000;
  const std::vector<Utime> ends{due - 20'000, due + 2'000, due + 60'000};
  Lio lio(test::tuned_config());
  (void)feed(lio, drive());
  std::vector<ScanStats> stats;
  const auto take = [&](const std::vector<ScanResult>& results) {
    for (const ScanResult& each : results) stats.push_back(each.stats);
  };
  auto end = ends.begin();
  for (Utime utime = last; utime <= due + 500'000; utime += 4'000) {
    for (; end != ends.end() && *end + lateness <= utime; ++end) {
      take(lio.add_scan({.utime = *end - 40'000, .duration_us = 40'000, .points = drive().scans.back().points}));
    }
    if (utime == last) {
      EXPECT_STREQ(lio.begin_anew_after(due, 0), "");
      continue;
    }
    ImuSample sample = drive().imu.front();
    sample.utime = utime;
    take(lio.add_imu(sample).scans);
  }
  EXPECT_EQ(lio.session(), 1);
  return stats;
}

TEST(BeginAnew, AScanAtTheEndHasTheSameVerdictWhetherItComesEarlyOrLate) {
  for (const Utime lateness : {-200'000, -30'000, 0, 6'000, 30'000, 400'000}) {
    const std::vector<ScanStats> stats = verdicts_around_the_end(lateness);
    ASSERT_EQ(stats.size(), 3U) << lateness;
    EXPECT_EQ(stats[0].reason, ScanReason::kSessionEnded) << lateness;
    EXPECT_EQ(stats[0].session, 0) << lateness;
    for (const std::size_t i : {1U, 2U}) {
      EXPECT_EQ(stats[i].reason, ScanReason::kNotInitialised) << lateness;
      EXPECT_EQ(stats[i].session, 1) << lateness;
    }
  }
}

TEST(BeginAnew, AScanThatWaitedIsNotTakenTwice) {
  Lio lio(test::tuned_config());
  (void)feed(lio, drive());
  const Utime due = drive().imu.back().utime + 200'000;
  ASSERT_STREQ(lio.begin_anew_after(due, 0), "");
  ImuSample sample = drive().imu.front();
  for (sample.utime = due - 196'000; sample.utime <= due; sample.utime += 4'000) (void)lio.add_imu(sample);
  const Scan scan{.utime = due - 38'000, .duration_us = 40'000, .points = drive().scans.back().points};
  EXPECT_TRUE(lio.add_scan(scan).empty()) << "it waits";
  (void)lio.add_imu(sample);
  ASSERT_EQ(lio.session(), 1);
  const std::vector<ScanResult> again = lio.add_scan(scan);
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].stats.reason, ScanReason::kBadStamp);
}

TEST(BeginAnew, ASecondCommandDoesNotPostponeTheFirst) {
  Lio lio(test::tuned_config());
  (void)feed(lio, drive());
  const Utime last = drive().imu.back().utime;
  EXPECT_STREQ(lio.begin_anew_after(last + 200'000, 0), "");
  EXPECT_STREQ(lio.begin_anew_after(last + 1'900'000, 0), "");
  ImuSample sample = drive().imu.front();
  for (sample.utime = last + 4'000; sample.utime <= last + 300'000; sample.utime += 4'000) (void)lio.add_imu(sample);
  EXPECT_EQ(lio.session(), 1);
  EXPECT_NE(lio.status().reason.find("0 was ended by a command"), std::string::npos);
}

TEST(BeginAnew, IsRefusedForAnotherSessionAndAStampThatIsNotAhead) {
  Lio lio(test::tuned_config());
  EXPECT_STRNE(lio.begin_anew_after(0, 0), "") << "nothing has come yet";
  (void)feed(lio, drive());
  const Utime last = drive().imu.back().utime;
  EXPECT_STRNE(lio.begin_anew_after(last + 300'000, 1), "");
  EXPECT_STRNE(lio.begin_anew_after(last + 149'000, 0), "") << "scans of that time may have had their verdict";
  EXPECT_STRNE(lio.begin_anew_after(last + 2'000'001, 0), "");
  (void)feed(lio, later(drive(), 2'100'000 + last - drive().imu.front().utime));
  EXPECT_EQ(lio.session(), 0);
}

}  // namespace
}  // namespace ignis
