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
  const Drive second = later(drive(), last - drive().imu.front().utime + 4'000);
  Lio lio(test::tuned_config());
  (void)feed(lio, drive());
  ASSERT_STREQ(lio.begin_anew_after(last, 0), "");
  EXPECT_EQ(lio.session(), 0) << "its time has not come";
  const std::vector<ScanResult> results = feed(lio, second);
  EXPECT_EQ(lio.session(), 1);
  EXPECT_EQ(lio.status().trust, Trust::kOk);

  // The sample that ended the session is not part of the next one.
  Drive rest = second;
  rest.imu.erase(rest.imu.begin());
  Lio fresh(test::tuned_config(), 1);
  const std::vector<ScanResult> expected = feed(fresh, rest);
  ASSERT_EQ(results.size(), expected.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    EXPECT_EQ(results[i].stats.session, 1);
    EXPECT_EQ(results[i].state.T_odom_body.translation, expected[i].state.T_odom_body.translation) << i;
    EXPECT_EQ(results[i].stats.map_points, expected[i].stats.map_points) << i;
    ASSERT_EQ(results[i].keyframe.has_value(), expected[i].keyframe.has_value()) << i;
    if (results[i].keyframe) {
      EXPECT_EQ(results[i].keyframe->id, expected[i].keyframe->id);
    }
  }
}

TEST(BeginAnew, AScanAtTheEndHasTheSameVerdictWhicheverCameFirst) {
  const Utime last = drive().imu.back().utime;
  const Utime due = last + 60'000;
  const auto verdicts = [&](bool scans_come_late) {
    Lio lio(test::tuned_config());
    (void)feed(lio, drive());
    EXPECT_STREQ(lio.begin_anew_after(due, 0), "");
    std::vector<ScanStats> stats;
    const auto take = [&](const std::vector<ScanResult>& results) {
      for (const ScanResult& each : results) stats.push_back(each.stats);
    };
    const auto sample_at = [&](Utime utime) {
      ImuSample sample = drive().imu.front();
      sample.utime = utime;
      take(lio.add_imu(sample).scans);
    };
    const auto scan_until = [&](Utime end) {
      take(lio.add_scan({.utime = end - 40'000, .duration_us = 40'000, .points = drive().scans.back().points}));
    };
    for (Utime utime = last + 4'000; utime <= due; utime += 4'000) sample_at(utime);
    if (scans_come_late) sample_at(due + 4'000);
    scan_until(due - 20'000);  // before the end
    scan_until(due + 2'000);   // behind it
    if (!scans_come_late) sample_at(due + 4'000);
    for (Utime utime = due + 8'000; utime <= due + 40'000; utime += 4'000) sample_at(utime);
    EXPECT_EQ(lio.session(), 1);
    EXPECT_NE(lio.status().reason.find("a command said so"), std::string::npos);
    return stats;
  };
  for (const bool scans_come_late : {false, true}) {
    const std::vector<ScanStats> stats = verdicts(scans_come_late);
    ASSERT_EQ(stats.size(), 2U) << scans_come_late;
    EXPECT_EQ(stats[0].reason, ScanReason::kSessionEnded);
    EXPECT_EQ(stats[0].session, 0);
    EXPECT_EQ(stats[1].reason, ScanReason::kNotInitialised);
    EXPECT_EQ(stats[1].session, 1);
  }
}

TEST(BeginAnew, IsRefusedForAnotherSessionAndAStampThatIsNotAhead) {
  Lio lio(test::tuned_config());
  EXPECT_STRNE(lio.begin_anew_after(0, 0), "") << "nothing has come yet";
  (void)feed(lio, drive());
  const Utime last = drive().imu.back().utime;
  EXPECT_STRNE(lio.begin_anew_after(last + 300'000, 1), "");
  EXPECT_STRNE(lio.begin_anew_after(last - 1, 0), "");
  EXPECT_STRNE(lio.begin_anew_after(last + 2'000'001, 0), "");
  (void)feed(lio, later(drive(), 2'100'000 + last - drive().imu.front().utime));
  EXPECT_EQ(lio.session(), 0);
}

}  // namespace
}  // namespace ignis
