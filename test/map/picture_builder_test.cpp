// SPDX-License-Identifier: Apache-2.0
#include "map/picture_builder.h"

#include <gtest/gtest.h>

#include "map/map_oracle.h"
#include "map/random_clouds.h"

namespace ignis {
namespace {

using test::oracle_view;
using test::pose_at;
using test::random_cloud;
using test::table_of;

Keyframe keyframe(std::int32_t id, const Pose& T_odom_body, std::vector<CloudPoint> cloud) {
  Keyframe keyframe;
  keyframe.id = id;
  keyframe.state.T_odom_body = T_odom_body;
  keyframe.cloud = std::move(cloud);
  return keyframe;
}

/// Whole numbers, as a byte shows them.
std::vector<CloudPoint> whole(std::vector<CloudPoint> cloud) {
  for (CloudPoint& point : cloud) point.intensity = std::floor(point.intensity);
  return cloud;
}

std::uint64_t sum_of(const MapPicture& picture) {
  std::uint64_t sum = 0;
  for (const SharedTilePicture& tile : picture.tiles) sum += checksum_of(*tile, picture.grid);
  return sum;
}

TEST(PictureBuilder, ShowsWhatTheDefinitionSaysWhileTheMapChanges) {
  std::mt19937 generator(1);
  LiveMap map(MapConfig{});
  std::map<double, PictureBuilder> builders;
  for (const double radius : {1.0, 15.0, 25.0, 60.0}) builders.try_emplace(radius, radius);
  for (int step = 0; step < 30; ++step) {
    const Pose pose = pose_at(1.5 * step, 0.05 * step, 0.0, 0.1 * step);
    map.insert_scan(whole(random_cloud(generator, 200, 14.0, 3.0)), pose);
    if (step % 4 == 0) map.add_keyframe(keyframe(step / 4, pose, whole(random_cloud(generator, 400, 35.0, 3.0))));
    if (step % 9 == 8) {
      const CorrectedPose moved{step / 9, pose_at(2.0 * step / 9, 0.1, 0.4)};
      map.correct(Pose{}, std::span(&moved, 1), step);
    }
    if (step % 3 != 0) continue;
    const RebuildJob job = map.as_drawn();
    for (auto& [radius, builder] : builders) {
      const MapPicture picture = builder.build(map.voxels());
      const test::ViewTable expected = oracle_view(job, radius);
      ASSERT_EQ(table_of(picture), expected) << "step " << step << " radius " << radius;
      EXPECT_EQ(picture.checksum, sum_of(picture));
      EXPECT_EQ(picture.counts[0] + picture.counts[1] + picture.counts[2], expected.voxels.size());
      EXPECT_TRUE(std::ranges::is_sorted(picture.tiles, {}, [](const auto& tile) { return tile->tile; }));
    }
  }
}

TEST(PictureBuilder, TakesUnchangedTilesOverAsTheyAre) {
  std::mt19937 generator(2);
  LiveMap map(MapConfig{});
  map.insert_scan(random_cloud(generator, 20'000, 20.0, 4.0), Pose{});
  PictureBuilder builder(25.0);
  const MapPicture before = builder.build(map.voxels());
  EXPECT_EQ(builder.build(map.voxels()).tiles, before.tiles);
  const CloudPoint point{{1.0F, 3.99F, 1.0F}, 7.0F};
  map.insert_scan(std::span(&point, 1), Pose{});
  const MapPicture after = builder.build(map.voxels());
  std::size_t changed = 0;
  for (std::size_t i = 0; i < after.tiles.size(); ++i) changed += after.tiles[i] != before.tiles[i] ? 1U : 0U;
  EXPECT_EQ(changed, 1U);
}

TEST(PictureBuilder, ARebuildThatChangesNothingKeepsTheTiles) {
  std::mt19937 generator(3);
  LiveMap map(MapConfig{});
  map.insert_scan(random_cloud(generator, 5'000, 20.0, 4.0), Pose{});
  PictureBuilder builder(25.0);
  const MapPicture before = builder.build(map.voxels());
  map.finish_rebuild(rebuild(map.begin_rebuild()));
  EXPECT_EQ(builder.build(map.voxels()).tiles, before.tiles);
}

TEST(PictureBuilder, HeightsAreThoseOfThePointsShown) {
  LiveMap map(MapConfig{});
  const std::vector<CloudPoint> cloud = {{{1.0F, -1.23F, 1.0F}, 0.0F}, {{2.0F, 3.21F, 1.0F}, 0.0F}};
  map.insert_scan(cloud, Pose{});
  const MapPicture picture = PictureBuilder(25.0).build(map.voxels());
  EXPECT_NEAR(picture.heights[0].min, -1.23, 1e-6);
  EXPECT_NEAR(picture.heights[0].max, 3.21, 1e-6);
  EXPECT_EQ(picture.counts[1], 0U) << "covered by the local level";
}

}  // namespace
}  // namespace ignis
