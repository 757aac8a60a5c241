// SPDX-License-Identifier: Apache-2.0
#include "replay_pipeline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "frontend/lio_runner.h"

namespace ignis {
namespace {

/// 16 s through the hall, the first two at rest.
test::Drive hall_drive() {
  return test::simulate(test::furnished_hall(), test::ellipse_drive(2.0, 6.0, 4.0, 1.0), 16.0, test::Sensors{}, 7);
}

/// `given`: counts the scans that were begun, if anyone wants to know.
ReplayResult replay(const test::Drive& drive, const runtime::IgnisConfig& config = {},
                    GraphListener* listener = nullptr, std::size_t* given = nullptr) {
  ReplayPipeline pipeline(config, true, listener);
  auto imu = drive.imu.begin();
  for (const Scan& scan : drive.scans) {
    if (given != nullptr) ++*given;
    for (; imu != drive.imu.end() && imu->utime <= scan.end_utime(); ++imu) pipeline.add_imu(*imu);
    pipeline.add_scan(scan);
  }
  for (; imu != drive.imu.end(); ++imu) pipeline.add_imu(*imu);
  return pipeline.finish();
}

TEST(ReplayPipeline, BeginsANewGraphWithTheFrontEndsNewSession) {
  // From one scan on all ranges are 6 % too long: nothing fits the old map, but the new scans fit one another.
  test::Drive drive = hall_drive();
  for (std::size_t i = 160; i < drive.scans.size(); ++i) {
    for (ScanPoint& point : drive.scans[i].points) point.position *= 1.06F;
  }
  const ReplayResult result = replay(drive);
  ASSERT_EQ(result.sessions, 2);
  const auto begin = std::ranges::find(result.scans, 1, &ScanStats::session);
  ASSERT_NE(begin, result.scans.end());
  EXPECT_GE(result.smoother.keyframes, 2) << "of the new session";
  EXPECT_EQ(result.graph.vertices.size(), static_cast<std::size_t>(result.smoother.keyframes));
  EXPECT_EQ(result.graph.vertices.front().id, 0);
  EXPECT_EQ(result.smoother.duplicates, 0);
  // The trajectories go on through the change, each stamp once.
  ASSERT_EQ(result.smoothed.size(), result.odometry.size());
  for (std::size_t i = 0; i < result.odometry.size(); ++i) {
    EXPECT_EQ(result.smoothed[i].utime, result.odometry[i].utime);
    EXPECT_LT(body_difference(result.smoothed[i].T_world_body, result.odometry[i].T_world_body).tail<3>().norm(), 0.5);
  }
}

/// Counts what the back end would publish.
class Publications : public GraphListener {
 public:
  void keyframe_sent(const keyframe_t& part) override {
    keyframes += part.part == 0 ? 1 : 0;
    newest = part.utime;
  }
  void graph_changed(const Smoother& smoother, const SmootherUpdate& update, std::int32_t /*session*/,
                     Utime /*utime*/) override {
    ++changes;
    loops += update.loop && update.loop->accepted() ? 1 : 0;
    if (!update.loop) swapped_at.push_back(smoother.stats().keyframes);
    EXPECT_EQ(update.revision, changes) << "every revision is told";
  }

  int keyframes = 0;
  Utime newest = 0;  ///< [us] of the newest keyframe
  int changes = 0;
  int loops = 0;
  std::vector<int> swapped_at;  ///< keyframes in the graph when the batch optimum took its place
};

TEST(ReplayPipeline, TakesTheBatchOptimumOverWhereTheBackEndDoes) {
  // Twice around, with any gap to the optimum worth a swap.
  runtime::IgnisConfig config;
  config.backend.shadow_swap_m = 1e-6;
  config.backend.shadow_swap_rad = 1e-7;
  config.frontend.loop_gates.loop_min_index_gap = 8;
  const test::Drive drive =
      test::simulate(test::furnished_hall(), test::ellipse_drive(2.0, 6.0, 4.0, 1.0), 50.0, test::Sensors{}, 7);
  Publications published;
  const ReplayResult result = replay(drive, config, &published);
  ASSERT_GE(published.loops, 1) << "the case is too easy";
  ASSERT_GE(published.swapped_at.size(), 1U);
  EXPECT_EQ(published.changes, published.keyframes + static_cast<int>(published.swapped_at.size()));
  const auto first = std::ranges::find_if(result.loops, &LoopResult::accepted);
  EXPECT_EQ(published.swapped_at.front(), first->keyframes + shadow_delay(first->keyframes));
}

class FailingListener : public GraphListener {
 public:
  explicit FailingListener(std::int32_t at) : at_(at) {}
  void keyframe_sent(const keyframe_t& part) override {
    if (part.id == at_) throw std::runtime_error("the keyframe");
  }
  void graph_changed(const Smoother& /*smoother*/, const SmootherUpdate& /*update*/, std::int32_t /*session*/,
                     Utime /*utime*/) override {}

 private:
  std::int32_t at_;
};

TEST(ReplayPipeline, ThrowsWhatTheOtherThreadThrewBeforeTheDriveEnds) {
  FailingListener listener(1);
  const test::Drive drive = hall_drive();
  std::size_t given = 0;
  try {
    static_cast<void>(replay(drive, {}, &listener, &given));
    FAIL() << "nothing was thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "the keyframe");
  }
  EXPECT_LT(given, drive.scans.size()) << "the front end has worked for nothing";
}

TEST(ReplayPipeline, ThrowsAtTheEndWhatTheOtherThreadThrewLast) {
  test::Drive drive = hall_drive();
  Publications published;
  static_cast<void>(replay(drive, {}, &published));
  ASSERT_GE(published.keyframes, 2);
  // Nothing follows the scan that the last keyframe is made of.
  std::erase_if(drive.scans, [&](const Scan& scan) { return scan.end_utime() > published.newest; });
  FailingListener listener(published.keyframes - 1);
  EXPECT_THROW(static_cast<void>(replay(drive, {}, &listener)), std::runtime_error);
}

TEST(ReplayPipeline, HasOneSessionWhereTheMapHolds) {
  const ReplayResult result = replay(hall_drive());
  EXPECT_EQ(result.sessions, 1);
  EXPECT_GE(result.smoother.keyframes, 4);
  EXPECT_EQ(result.smoothed.size(), result.odometry.size());
}

}  // namespace
}  // namespace ignis
