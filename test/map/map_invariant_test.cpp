// SPDX-License-Identifier: Apache-2.0
//
// The invariant of the map, by property: whatever happened, and in whatever order, the live map equals one that is
// built afresh from the same clouds, poses and windows, and both equal what brute force makes of the definition.

#include <optional>

#include <gtest/gtest.h>

#include "map/live_map.h"
#include "map/map_oracle.h"
#include "map/picture_builder.h"
#include "map/random_clouds.h"

namespace ignis {
namespace {

using test::pose_at;
using test::random_cloud;

/// A drive in which everything happens at random: scans, keyframes (also late ones), jumps that slide the windows,
/// corrections of few and of many, rebuilds that overlap with all of it, and clouds dropped for want of room.
class RandomDrive {
 public:
  RandomDrive(std::uint32_t seed, const MapConfig& config) : generator_(seed), map_(config) {}

  void step() {
    drive();
    const auto dice = static_cast<unsigned>(generator_() % 20);
    if (dice < 8) {
      map_.insert_scan(random_cloud(generator_, 60, reach(), 3.0), pose_);
    } else if (dice < 12) {
      add_keyframe();
    } else if (dice < 16) {
      correct(dice < 14 ? 3 : 1);
    } else if (dice == 16 && !job_ && map_.needs_rebuild()) {
      job_ = map_.begin_rebuild();
    } else if (dice == 17 && job_) {
      finish();
    } else if (dice == 18) {
      const CorrectedPose unknown{next_id_ + 5, random_pose()};  // its cloud is still to come
      map_.correct(T_map_odom_, std::span(&unknown, 1));
    }
  }

  void finish() {
    if (!job_) return;
    map_.finish_rebuild(rebuild(*job_));
    job_.reset();
  }

  void draw_at_rebuild() { map_.draw_at_rebuild(); }

  /// From a far place, to which the windows jump whatever they did before.
  void redraw() {
    finish();
    pose_ = pose_ * pose_at(8.0, 0.0, 8.0, 0.0);
    map_.insert_scan(random_cloud(generator_, 60, reach(), 3.0), pose_);
    map_.finish_rebuild(rebuild(map_.begin_rebuild()));
  }

  [[nodiscard]] const LiveMap& map() const { return map_; }

 private:
  [[nodiscard]] double reach() { return generator_() % 4 == 0 ? 45.0 : 12.0; }
  [[nodiscard]] double noise(double size) { return std::uniform_real_distribution<double>(-size, size)(generator_); }
  [[nodiscard]] Pose random_pose() { return pose_at(noise(60), noise(1), noise(60), noise(3)); }

  void drive() {
    if (generator_() % 30 == 0) {
      pose_ = random_pose();
    } else {
      pose_ = pose_ * pose_at(noise(0.2), noise(0.05), noise(1.0), noise(0.2));
    }
  }
  void add_keyframe() {
    Keyframe keyframe;
    // Now and then one is lost, and comes when its successors are there.
    if (generator_() % 5 == 0) late_.push_back(next_id_++);
    keyframe.id = next_id_++;
    if (!late_.empty() && generator_() % 3 == 0) {
      keyframe.id = late_.back();
      late_.pop_back();
    }
    keyframe.state.T_odom_body = pose_;
    keyframe.cloud = random_cloud(generator_, 150, reach(), 3.0);
    map_.add_keyframe(keyframe);
  }
  void correct(unsigned one_in) {
    std::vector<CorrectedPose> poses;
    for (const auto& [id, position] : map_.keyframe_positions()) {
      if (generator_() % (2 * one_in) != 0) continue;
      const Eigen::Vector3d p = position.cast<double>();
      poses.push_back({id, pose_at(p.x() + noise(0.3), p.y() + noise(0.1), p.z() + noise(0.3), noise(3))});
    }
    T_map_odom_ = pose_at(noise(0.5), noise(0.1), noise(0.5), noise(0.1));
    map_.correct(T_map_odom_, poses, ++revision_);
  }

  std::mt19937 generator_;
  LiveMap map_;
  Pose pose_;
  Pose T_map_odom_;
  std::int32_t next_id_ = 0;
  std::int32_t revision_ = 0;
  std::vector<std::int32_t> late_;
  std::optional<RebuildJob> job_;
};

/// Cells as always; small windows, so that much passes their rims; every correction counts.
MapConfig small_world() {
  MapConfig config;
  config.local_window_m = 6.0;
  config.mid_window_m = 14.0;
  config.coarse_window_m = 40.0;
  config.height_window_m = 3.0;
  config.rebuild_shift_m = 0.0;
  config.rebuild_turn_rad = 0.0;
  config.reanchor_points = 3'000;
  return config;
}

void expect_invariant(const LiveMap& map, std::uint32_t seed, int step) {
  const RebuildJob job = map.as_drawn();
  const std::string fresh = rebuild(job).fingerprint();
  ASSERT_EQ(map.voxels().fingerprint(), fresh) << "seed " << seed << " step " << step;
}

TEST(MapInvariant, TheLiveMapEqualsAFreshOneAfterAnySequence) {
  int rebuilds = 0;
  std::int64_t reanchored = 0;
  for (std::uint32_t seed = 1; seed <= 12; ++seed) {
    RandomDrive drive(seed, small_world());
    for (int step = 0; step < 150; ++step) {
      drive.step();
      if (step % 5 == 0) expect_invariant(drive.map(), seed, step);
      if (HasFatalFailure()) return;
    }
    drive.finish();
    expect_invariant(drive.map(), seed, 150);
    rebuilds += drive.map().rebuilds();
    reanchored += drive.map().reanchored();
  }
  EXPECT_GT(rebuilds, 10) << "the sequences must contain rebuilds";
  EXPECT_GT(reanchored, 100) << "and corrections that are followed at once";
}

TEST(MapInvariant, HoldsWhenFarCloudsAreDropped) {
  MapConfig config = small_world();
  config.max_keyframe_points = 10'000;
  std::int64_t dropped = 0;
  for (std::uint32_t seed = 21; seed <= 24; ++seed) {
    RandomDrive drive(seed, config);
    for (int step = 0; step < 400; ++step) {
      drive.step();
      if (step % 20 == 0) expect_invariant(drive.map(), seed, step);
      if (HasFatalFailure()) return;
    }
    drive.finish();
    expect_invariant(drive.map(), seed, 400);
    dropped += drive.map().clouds().dropped();
    EXPECT_TRUE(drive.map().needs_rebuild() || drive.map().clouds().points() <= 10'000U);
  }
  EXPECT_GT(dropped, 20);
}

TEST(MapInvariant, HoldsWhenTheMapMustCoarsen) {
  MapConfig config = small_world();
  config.max_voxels = 10'000;
  int coarsening = 0;
  for (std::uint32_t seed = 31; seed <= 33; ++seed) {
    RandomDrive drive(seed, config);
    for (int step = 0; step < 300; ++step) {
      drive.step();
      ASSERT_LE(drive.map().voxels().size(), 10'000U);
      if (step % 20 == 0) expect_invariant(drive.map(), seed, step);
      if (HasFatalFailure()) return;
    }
    coarsening += drive.map().voxels().coarsening();
  }
  EXPECT_GT(coarsening, 0);
}

TEST(MapInvariant, HoldsWhenFreeSpaceIsCarved) {
  MapConfig config = small_world();
  config.carve_free_space = true;
  config.carve_rays = 1;
  config.max_keyframe_points = 10'000;
  for (const int keyframes : {1, 2}) {
    config.carve_keyframes = keyframes;
    for (std::uint32_t seed = 51; seed <= 54; ++seed) {
      RandomDrive drive(seed, config);
      for (int step = 0; step < 150; ++step) {
        drive.step();
        if (step % 10 == 0) expect_invariant(drive.map(), seed, step);
        if (HasFatalFailure()) return;
      }
      drive.finish();
      const RebuildJob job = drive.map().as_drawn();
      const auto levels = test::oracle_levels(job);
      for (std::size_t i = 0; i < kLevels; ++i) EXPECT_EQ(drive.map().voxels().sorted(i).size(), levels[i].size());
      EXPECT_TRUE(std::ranges::any_of(test::oracle_votes(job), [&](const auto& v) { return v.second >= keyframes; }));
    }
  }
}

TEST(MapInvariant, AMapDrawnAtTheEndEqualsOneThatWasDrawnAllAlong) {
  MapConfig config = small_world();
  config.carve_free_space = true;
  for (std::uint32_t seed = 61; seed <= 66; ++seed) {
    RandomDrive all_along(seed, config);
    RandomDrive at_the_end(seed, config);
    at_the_end.draw_at_rebuild();
    for (int step = 0; step < 200; ++step) {
      all_along.step();
      at_the_end.step();
      ASSERT_EQ(at_the_end.map().voxels().size(), 0U);
    }
    all_along.redraw();
    at_the_end.redraw();
    ASSERT_GT(at_the_end.map().voxels().size(), 500U);
    EXPECT_EQ(at_the_end.map().voxels().fingerprint(), all_along.map().voxels().fingerprint()) << "seed " << seed;
    at_the_end.step();
    expect_invariant(at_the_end.map(), seed, 201);
  }
}

TEST(MapInvariant, ViewsEqualTheDefinitionAfterAnySequence) {
  for (std::uint32_t seed = 41; seed <= 43; ++seed) {
    RandomDrive drive(seed, small_world());
    PictureBuilder builder(20.0);
    for (int step = 0; step < 120; ++step) {
      drive.step();
      const MapPicture picture = builder.build(drive.map().voxels());
      if (step % 10 != 0) continue;
      ASSERT_EQ(test::table_of(picture), test::oracle_view(drive.map().as_drawn(), 20.0))
          << "seed " << seed << " step " << step;
    }
  }
}

}  // namespace
}  // namespace ignis
