// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "backend/memory_archive.h"
#include "backend/smoother.h"
#include "backend/synthetic_drive.h"
#include "backend/text_contains.h"

/// A back end whose memory holds a few of its clouds.
namespace ignis {
namespace {

BackendConfig with_memory(double megabytes) {
  BackendConfig config;
  config.cloud_memory_mb = megabytes;
  return config;
}

/// About 12 kB a cloud: 0.1 MB are a fifth of them.
const testing::Drive& two_laps() {
  static const testing::Drive drive = testing::make_drive({.seed = 2, .keyframes = 45, .cloud_points = 3000});
  return drive;
}

/// A smoother and its journal.
struct Keeper {
  explicit Keeper(const BackendConfig& chosen) : config(chosen), smoother(config, LoopGates(), &archive) {}

  SmootherUpdate add(const Keyframe& keyframe) {
    SmootherUpdate update = smoother.add_keyframe(keyframe);
    archive.records.push_back(smoother.take_change());
    return update;
  }

  void resume() {
    const std::vector<std::span<const std::byte>> spans(archive.records.begin(), archive.records.end());
    smoother = restore_smoother(config, LoopGates(), spans, &archive).smoother;
  }

  BackendConfig config;
  testing::MemoryArchive archive;
  Smoother smoother;
};

TEST(SmootherMemory, FindsTheSameLoopsWithFewCloudsInMemoryAndAJournal) {
  Smoother roomy{BackendConfig(), LoopGates()};
  Keeper small(with_memory(0.1));
  for (const Keyframe& keyframe : two_laps().keyframes) {
    const SmootherUpdate expected = roomy.add_keyframe(keyframe);
    const SmootherUpdate update = small.add(keyframe);
    ASSERT_EQ(update.loop->reason_text, expected.loop->reason_text);
    ASSERT_EQ(update.newest.T_odom_body.translation, expected.newest.T_odom_body.translation);
  }
  EXPECT_GE(roomy.stats().loops_kept, 3);
  EXPECT_EQ(small.smoother.stats().loops_kept, roomy.stats().loops_kept);
  EXPECT_GT(small.archive.reads, 10);
  EXPECT_EQ(small.smoother.stats().clouds_unreadable, 0);
}

TEST(SmootherMemory, FindsTheSameLoopsAfterItWasKilled) {
  Smoother roomy{BackendConfig(), LoopGates()};
  Keeper small(with_memory(0.1));
  for (const Keyframe& keyframe : two_laps().keyframes) {
    const SmootherUpdate expected = roomy.add_keyframe(keyframe);
    const SmootherUpdate update = small.add(keyframe);
    ASSERT_EQ(update.loop->reason, expected.loop->reason);
    ASSERT_EQ(update.loop->to_id, expected.loop->to_id);
    if (keyframe.id % 9 == 5) small.resume();
  }
  EXPECT_GE(roomy.stats().loops_kept, 3);
  EXPECT_EQ(small.smoother.stats().loops_kept, roomy.stats().loops_kept);
}

TEST(SmootherMemory, RefusesACandidateWhoseRecordIsDamagedAndGoesOn) {
  Keeper small(with_memory(0.1));
  int lost = 0;
  for (const Keyframe& keyframe : two_laps().keyframes) {
    if (keyframe.id == 20) {
      for (std::vector<std::byte>& record : small.archive.records) record.resize(record.size() / 2);
    }
    const SmootherUpdate update = small.add(keyframe);
    ASSERT_TRUE(update.accepted());
    if (update.loop->reason != LoopReason::kCloudLost) continue;
    ++lost;
    EXPECT_TRUE(testing::contains(update.loop->reason_text, "cannot be read back"));
    EXPECT_EQ(update.loop->stage, LoopStage::kCandidate);
    EXPECT_FALSE(update.loop->accepted());
  }
  EXPECT_GT(lost, 3);
  EXPECT_GE(small.smoother.stats().clouds_unreadable, lost);
  EXPECT_EQ(small.smoother.stats().keyframes, 45);
}

TEST(SmootherMemory, ForgetsPlacesWithoutAJournalAndSaysWhich) {
  Smoother smoother(with_memory(0.1), LoopGates());
  int lost = 0;
  for (const Keyframe& keyframe : two_laps().keyframes) {
    const SmootherUpdate update = smoother.add_keyframe(keyframe);
    ASSERT_TRUE(update.accepted());
    if (update.loop->reason != LoopReason::kCloudLost) continue;
    ++lost;
    EXPECT_TRUE(testing::contains(update.loop->reason_text, "dropped: backend.cloud_memory_mb, and no journal"));
  }
  EXPECT_GT(lost, 3);
  EXPECT_GT(smoother.stats().clouds_forgotten, 20);
}

}  // namespace
}  // namespace ignis
