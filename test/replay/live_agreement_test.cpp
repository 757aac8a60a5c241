// SPDX-License-Identifier: Apache-2.0
#include "live_agreement.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "messages/odometry_messages.h"

namespace ignis {
namespace {

ScanStats scan(int index) {
  ScanStats stats;
  stats.utime = 1'000'000 + 50'000 * index;
  stats.scan_sequence = index;
  stats.reason = ScanReason::kApplied;
  stats.matched = 100 + index;
  stats.nis = 0.1 * index;
  stats.T_odom_body.translation = {0.1 * index, 0.0, -1.0 / (1 + index)};
  return stats;
}

/// What a live front end recorded: encoded messages that outlive their views.
class Recorded {
 public:
  void add(const ScanStats& stats, std::int32_t sequence) {
    scan_stats_t message = messages::to_message(stats);
    message.sequence = sequence;
    message.time_spent_ms = 1.5 + sequence;  // differs from run to run and must not count
    std::vector<std::byte>& bytes = buffers_.emplace_back(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  }
  [[nodiscard]] std::vector<std::span<const std::byte>> views() const { return {buffers_.begin(), buffers_.end()}; }

 private:
  std::vector<std::vector<std::byte>> buffers_;
};

TEST(LiveAgreement, IsCompleteWhenEveryFieldIsEqual) {
  Recorded live;
  std::vector<ScanStats> replayed;
  for (int i = 0; i < 5; ++i) {
    live.add(scan(i), i);
    replayed.push_back(scan(i));
  }
  const LiveAgreement agreement = agreement_with_live(live.views(), replayed);
  EXPECT_TRUE(agreement.complete());
  EXPECT_EQ(agreement.equal, 5);
  EXPECT_FALSE(agreement.first_unequal);
  EXPECT_EQ(agreement.largest_distance_m, 0.0);
}

TEST(LiveAgreement, SeesTheLastBitOfOneNumber) {
  Recorded live;
  std::vector<ScanStats> replayed;
  for (int i = 0; i < 5; ++i) {
    live.add(scan(i), i);
    replayed.push_back(scan(i));
  }
  double& x = replayed[3].T_odom_body.translation.x();
  x = std::nextafter(x, 1e9);
  LiveAgreement agreement = agreement_with_live(live.views(), replayed);
  EXPECT_EQ(agreement.equal, 4);
  EXPECT_EQ(agreement.first_unequal, scan(3).utime);
  EXPECT_GT(agreement.largest_distance_m, 0.0);

  replayed[3] = scan(3);
  replayed[1].matched += 1;  // a figure that is no pose counts as well
  agreement = agreement_with_live(live.views(), replayed);
  EXPECT_EQ(agreement.first_unequal, scan(1).utime);
  EXPECT_EQ(agreement.largest_distance_m, 0.0);
}

TEST(LiveAgreement, CountsWhatTheReplayDoesNotHave) {
  Recorded live;
  for (int i = 0; i < 3; ++i) live.add(scan(i), i);
  const LiveAgreement agreement = agreement_with_live(live.views(), {scan(0), scan(2)});
  EXPECT_EQ(agreement.recorded, 3);
  EXPECT_EQ(agreement.equal, 2);
  EXPECT_EQ(agreement.first_unequal, scan(1).utime);
}

TEST(LiveAgreement, LooksNoFurtherThanTheReplayWent) {
  Recorded live;
  for (int i = 0; i < 10; ++i) live.add(scan(i), i);
  const LiveAgreement agreement = agreement_with_live(live.views(), {scan(0), scan(1)});
  EXPECT_EQ(agreement.recorded, 2);
  EXPECT_TRUE(agreement.complete());
}

TEST(LiveAgreement, FindsTheFirstDifferenceInAnyOrderAndTellsALateRecorder) {
  Recorded live;
  for (const int i : {4, 2, 3}) live.add(scan(i), i + 100);
  ScanStats early = scan(2);
  ScanStats late = scan(4);
  early.nis += 1.0;
  late.nis += 1.0;
  const LiveAgreement agreement = agreement_with_live(live.views(), {early, scan(3), late});
  EXPECT_EQ(agreement.first_unequal, scan(2).utime);
  EXPECT_EQ(agreement.first_sequence, 102);
}

}  // namespace
}  // namespace ignis
