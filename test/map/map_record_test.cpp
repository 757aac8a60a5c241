// SPDX-License-Identifier: Apache-2.0
#include "map/map_record.h"

#include <gtest/gtest.h>

#include <random>

#include "map/random_clouds.h"

namespace ignis {
namespace {

using test::pose_at;
using test::random_cloud;

MapConfig small_world() {
  MapConfig config;
  config.local_window_m = 6.0;
  config.mid_window_m = 14.0;
  config.coarse_window_m = 40.0;
  return config;
}

/// A drive with scans before the first keyframe and with keyframes that come late; records go through their bytes.
class RecordedDrive {
 public:
  explicit RecordedDrive(std::uint32_t seed, const MapConfig& config) : generator_(seed), map_(config) {}

  void drive(int steps) {
    for (int i = 0; i < steps; ++i) {
      pose_ = pose_ * pose_at(0.3, 0.0, 0.2, 0.02);
      if (i % 7 == 6) add_keyframe();
      utime_ += 50'000;
      const std::vector<CloudPoint> scan = random_cloud(generator_, 80, 9.0, 2.0);
      map_.insert_scan(scan, pose_);
      if (const auto record = record_of_scan(map_, scan, utime_, pose_)) keep(*record);
    }
  }

  void correct(LiveMap& map) const {
    std::vector<CorrectedPose> poses;
    for (std::int32_t id = 0; id < next_id_; ++id) poses.push_back({id, pose_at(0.7 * id, 0.1, 0.3 * id, 0.05 * id)});
    map.correct(pose_at(0.5, 0.0, -0.2, 0.1), poses, 3);
    if (map.needs_rebuild()) map.finish_rebuild(rebuild(map.begin_rebuild()));
  }

  [[nodiscard]] LiveMap& map() { return map_; }
  [[nodiscard]] std::vector<MapRecord> records() const {
    std::vector<MapRecord> records;
    for (const auto& bytes : kept_) records.push_back(decode_record(bytes).value());
    return records;
  }
  [[nodiscard]] std::size_t recorded_points() const {
    std::size_t points = 0;
    for (const MapRecord& record : records()) points += record.points.size();
    return points;
  }

 private:
  void add_keyframe() {
    Keyframe keyframe;
    keyframe.id = next_id_++;
    // Every fourth is overtaken by its successor.
    if (keyframe.id % 4 == 2) std::swap(keyframe.id, overtaken_);
    if (keyframe.id < 0) return;
    add(keyframe);
    if (keyframe.id % 4 == 3 && overtaken_ >= 0) {
      keyframe.id = std::exchange(overtaken_, -1);
      add(keyframe);
    }
  }
  void add(Keyframe& keyframe) {
    keyframe.state.utime = utime_;
    keyframe.state.T_odom_body = pose_;
    keyframe.cloud = random_cloud(generator_, 150, 9.0, 2.0);
    ASSERT_TRUE(map_.add_keyframe(keyframe));
    keep(record_of_keyframe(map_, keyframe));
  }
  void keep(const MapRecord& record) { kept_.push_back(encode(record)); }

  std::mt19937 generator_;
  LiveMap map_;
  Pose pose_;
  Utime utime_ = 1'000'000;
  std::int32_t next_id_ = 0;
  std::int32_t overtaken_ = -1;
  std::vector<std::vector<std::byte>> kept_;
};

class RestoredMap : public testing::TestWithParam<bool> {};

TEST_P(RestoredMap, EqualsTheOneThatWasLostVoxelForVoxelAndGoesOnLikeIt) {
  MapConfig config = small_world();
  config.carve_free_space = GetParam();
  config.carve_rays = 1;
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    RecordedDrive drive(seed, config);
    drive.drive(100);
    std::vector<MapRecord> records = drive.records();
    EXPECT_TRUE(std::ranges::any_of(records, &MapRecord::is_late));
    EXPECT_TRUE(std::ranges::any_of(records, [](const MapRecord& each) { return each.id < 0; }));
    // As they come from files, one for each keyframe, in any order.
    std::ranges::stable_sort(records, std::greater{}, &MapRecord::id);
    LiveMap restored(config);
    restore(restored, std::move(records));
    EXPECT_EQ(restored.clouds().points(), drive.map().clouds().points());
    // The back end tells its poses again, whereupon both stand where it says.
    drive.correct(restored);
    drive.correct(drive.map());
    ASSERT_GT(restored.voxels().size(), 1000U);
    EXPECT_EQ(restored.voxels().fingerprint(), drive.map().voxels().fingerprint()) << "seed " << seed;
    std::mt19937 generator(seed);
    for (int i = 0; i < 5; ++i) {
      const std::vector<CloudPoint> scan = random_cloud(generator, 80, 9.0, 2.0);
      drive.map().insert_scan(scan, pose_at(30.0, 0.0, 20.0 + i));
      restored.insert_scan(scan, pose_at(30.0, 0.0, 20.0 + i));
    }
    EXPECT_EQ(restored.voxels().fingerprint(), drive.map().voxels().fingerprint()) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Carving, RestoredMap, testing::Bool());

TEST(MapRecord, HoldsOnlyWhatTheMapKeeps) {
  MapConfig config = small_world();
  RecordedDrive drive(1, config);
  drive.drive(60);
  EXPECT_EQ(drive.recorded_points(), drive.map().clouds().points());
  const std::size_t before = drive.records().size();
  const Pose still = pose_at(50.0, 0.0, 0.0);
  const std::vector<CloudPoint> scan{{.position = {1.0F, 0.0F, 0.0F}, .intensity = 1.0F}};
  drive.map().insert_scan(scan, still);
  EXPECT_TRUE(record_of_scan(drive.map(), scan, 1, still));
  drive.map().insert_scan(scan, still);
  EXPECT_FALSE(record_of_scan(drive.map(), scan, 2, still)) << "it said nothing new";
  drive.map().insert_scan(scan, pose_at(std::nan(""), 0.0, 0.0));
  EXPECT_FALSE(record_of_scan(drive.map(), scan, 3, still)) << "it was refused";
  EXPECT_EQ(drive.records().size(), before);
}

TEST(MapRecord, OfAKeyframeWhoseRecordIsMissingIsLeftOut) {
  RecordedDrive drive(1, small_world());
  drive.drive(40);
  std::vector<MapRecord> records = drive.records();
  std::erase_if(records, [](const MapRecord& each) { return each.id == 1 && each.is_keyframe; });
  LiveMap restored(small_world());
  restore(restored, std::move(records));
  EXPECT_FALSE(restored.clouds().contains(1));
  EXPECT_TRUE(restored.clouds().contains(0));
  EXPECT_EQ(restored.missing_keyframes(2, 5, [](std::int32_t) { return true; }), std::vector<std::int32_t>{1});
}

TEST(MapRecord, SurvivesAnyBytes) {
  RecordedDrive drive(1, small_world());
  drive.drive(8);
  const std::vector<std::byte> whole = encode(drive.records().front());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(decode_record(std::span(whole).first(size))) << "cut at " << size;
  }
  const MapRecordHead head{.config_fingerprint = "abc", .session = 7};
  EXPECT_EQ(decode_head(encode(head)), head);
  EXPECT_FALSE(decode_head(whole));
}

}  // namespace
}  // namespace ignis
