// SPDX-License-Identifier: Apache-2.0
#include "backend/journal/cloud_store.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "backend/journal/graph_change.h"
#include "backend/keyframes/erase_places.h"
#include "backend/memory_archive.h"
#include "backend/text_contains.h"

namespace ignis {
namespace {

constexpr std::size_t kPoints = 100;
constexpr std::size_t kCloudBytes = 6 * kPoints;

CompactCloud cloud_of(std::int32_t keyframe) {
  std::vector<CloudPoint> points(kPoints);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].position = {0.001F * static_cast<float>(i), 0.002F * static_cast<float>(keyframe), -1.0F};
  }
  return compact(points);
}

std::vector<std::byte> record_of(std::int32_t keyframe) {
  GraphChange change;
  change.state.nodes.emplace_back().end.id = keyframe;
  change.clouds.push_back(cloud_of(keyframe));
  return encode_change(change);
}

/// As a process with a journal does it: the cloud enters, then its record is written.
void add(CloudStore& store, testing::MemoryArchive& archive, std::int32_t keyframe) {
  store.add(keyframe, cloud_of(keyframe));
  archive.records.push_back(record_of(keyframe));
  store.note_record(archive.records.size() - 1);
}

bool is_cloud_of(const CloudLookup& found, std::int32_t keyframe) {
  const std::vector<CloudPoint> expected = expanded(cloud_of(keyframe));
  return found.problem.empty() &&
         std::ranges::equal(found.points, expected, {}, &CloudPoint::position, &CloudPoint::position);
}

TEST(CloudStore, GivesEveryCloudWhateverWasUsedAndStaysWithinItsBound) {
  constexpr std::size_t kBound = 5 * kCloudBytes;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    std::mt19937 random(seed);
    testing::MemoryArchive archive;
    CloudStore store(kBound, &archive);
    for (std::int32_t keyframe = 0; keyframe < 60; ++keyframe) {
      add(store, archive, 2 * keyframe);  // ids are not indices
      EXPECT_LE(store.bytes_in_memory(), kBound + kCloudBytes);
      for (int looks = 0; looks < 3; ++looks) {
        const auto index = random() % store.size();
        ASSERT_TRUE(is_cloud_of(store.find(index), 2 * static_cast<std::int32_t>(index)));
      }
    }
    EXPECT_EQ(store.forgotten(), 0);
    EXPECT_EQ(store.unreadable(), 0);
    EXPECT_GT(archive.reads, 20);
  }
}

TEST(CloudStore, GivesEveryOtherCloudWhateverWasLetGo) {
  constexpr std::size_t kBound = 5 * kCloudBytes;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    std::mt19937 random(seed);
    testing::MemoryArchive archive;
    CloudStore store(kBound, &archive);
    std::vector<std::int32_t> held;
    for (std::int32_t keyframe = 0; keyframe < 60; ++keyframe) {
      add(store, archive, keyframe);
      held.push_back(keyframe);
      EXPECT_LE(store.bytes_in_memory(), kBound + kCloudBytes);
      if (keyframe % 7 == 6) {
        const std::size_t first = random() % (held.size() - 3);
        const std::vector<std::size_t> gone{first, first + 2};
        store.erase(gone);
        erase_places(held, gone);
      }
      ASSERT_EQ(store.size(), held.size());
      EXPECT_EQ(store.recorded(), held.size());
      const auto index = random() % held.size();
      ASSERT_TRUE(is_cloud_of(store.find(index), held[index]));
    }
    for (std::size_t i = 0; i < held.size(); ++i) ASSERT_TRUE(is_cloud_of(store.find(i), held[i]));
  }
}

TEST(CloudStore, ReadsBackWhatWasUsedLongestAgo) {
  testing::MemoryArchive archive;
  CloudStore store(2 * kCloudBytes, &archive);
  for (std::int32_t keyframe = 0; keyframe < 3; ++keyframe) add(store, archive, keyframe);
  ASSERT_TRUE(is_cloud_of(store.find(0), 0));
  add(store, archive, 3);  // three are too many: the one of keyframe 1 goes
  EXPECT_EQ(archive.reads, 0);
  ASSERT_TRUE(is_cloud_of(store.find(0), 0));
  ASSERT_TRUE(is_cloud_of(store.find(2), 2));
  EXPECT_EQ(archive.reads, 0);
  ASSERT_TRUE(is_cloud_of(store.find(1), 1));
  EXPECT_EQ(archive.reads, 1);
}

TEST(CloudStore, KeepsWhatNoRecordHoldsYet) {
  const testing::MemoryArchive archive;
  CloudStore store(kCloudBytes, &archive);
  for (std::int32_t keyframe = 0; keyframe < 10; ++keyframe) store.add(keyframe, cloud_of(keyframe));
  for (std::size_t i = 0; i < 10; ++i) EXPECT_TRUE(is_cloud_of(store.find(i), static_cast<std::int32_t>(i)));
}

TEST(CloudStore, ForgetsAndCountsWithoutAnArchive) {
  CloudStore store(4 * kCloudBytes, nullptr);
  for (std::int32_t keyframe = 0; keyframe < 10; ++keyframe) store.add(keyframe, cloud_of(keyframe));
  EXPECT_EQ(store.forgotten(), 5);
  EXPECT_TRUE(testing::contains(store.find(4).problem, "cloud of keyframe 4 was dropped: backend.cloud_memory_mb"));
  EXPECT_TRUE(is_cloud_of(store.find(5), 5));
  EXPECT_EQ(store.unreadable(), 0);
}

TEST(CloudStore, NamesAndCountsWhatCannotBeReadBack) {
  testing::MemoryArchive archive;
  CloudStore store(kCloudBytes, &archive);
  for (std::int32_t keyframe = 0; keyframe < 6; ++keyframe) add(store, archive, keyframe);
  archive.records[0].resize(30);           // cut short
  archive.records[1] = record_of(77);      // of another keyframe
  archive.records[2] = encode_change({});  // of none
  for (std::size_t i = 0; i < 3; ++i) {
    const CloudLookup found = store.find(i);
    EXPECT_TRUE(found.points.empty());
    EXPECT_EQ(found.problem, "the cloud of keyframe " + std::to_string(i) + " cannot be read back");
  }
  EXPECT_EQ(store.unreadable(), 3);
  EXPECT_TRUE(is_cloud_of(store.find(3), 3));
}

}  // namespace
}  // namespace ignis
