// SPDX-License-Identifier: Apache-2.0
#include "map_builder/lasting_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "map/random_clouds.h"
#include "process_cost.h"
#include "slow_build.h"
#include "test_folder.h"

/// What it costs to have a large map back out of its journal.
namespace ignis {
namespace {

constexpr int kScans = 320;
constexpr int kScansPerKeyframe = 4;
constexpr double kStepM = 0.5;
constexpr std::size_t kPoints = 6000;
constexpr double kMostMsPerMillion = 3000.0 * test::kBuildSlowdown;

/// The fine level reaches as far as the drive, so that a short one fills it.
MapConfig wide_map() {
  MapConfig config;
  config.local_window_m = 180.0;
  config.mid_window_m = 190.0;
  config.coarse_window_m = 200.0;
  return config;
}

/// Straight ahead through an aisle between shelves, with the floor.
class Aisle {
 public:
  messages::PosedCloud scan() {
    messages::PosedCloud cloud;
    cloud.sequence = step_;
    cloud.utime = 1'000'000 + 50'000 * Utime{step_};
    cloud.applied = true;
    cloud.T_odom_body = test::pose_at(0.0, 0.0, -kStepM * step_++);
    for (std::size_t i = 0; i < kPoints; ++i) {
      const bool is_floor = i % 3 == 0;
      const float x = is_floor ? 6.0F * unit_(random_) : (i % 3 == 1 ? 3.0F : -6.0F);
      const float y = is_floor ? -0.5F : 2.0F + 2.5F * unit_(random_);
      cloud.points.push_back({.position = {x, y, 12.0F * unit_(random_)}, .intensity = 100.0F});
    }
    return cloud;
  }

  static Keyframe keyframe(const messages::PosedCloud& cloud) {
    Keyframe keyframe;
    keyframe.id = cloud.sequence / kScansPerKeyframe;
    keyframe.state.utime = cloud.utime;
    keyframe.state.T_odom_body = cloud.T_odom_body;
    keyframe.cloud = cloud.points;
    return keyframe;
  }

 private:
  std::mt19937 random_{1};
  std::uniform_real_distribution<float> unit_{-1.0F, 1.0F};
  int step_ = 0;
};

/// The back end tells its poses, as it does after a restart, and the map is drawn by them.
std::string drawn(LiveMap& map) {
  std::vector<CorrectedPose> poses;
  for (int id = 0; id < kScans / kScansPerKeyframe; ++id) {
    poses.push_back({id, test::pose_at(0.0, 0.0, -1.01 * kStepM * kScansPerKeyframe * id)});
  }
  map.correct(Pose(), poses, 1);
  if (map.needs_rebuild()) map.finish_rebuild(rebuild(map.begin_rebuild()));
  return map.voxels().fingerprint();
}

TEST(Fault_P4, ALargeMapIsBackOutOfItsJournalWithinThreeSecondsPerMillionVoxels) {
  const std::filesystem::path folder = test::fresh_folder();
  Aisle aisle;
  std::string before;
  std::size_t voxels = 0;
  {
    LastingMap map(wide_map(), folder);
    for (int i = 0; i < kScans; ++i) {
      const messages::PosedCloud cloud = aisle.scan();
      map.insert_scan(cloud);
      if (i % kScansPerKeyframe != 0) continue;
      ASSERT_TRUE(map.add_keyframe(Aisle::keyframe(cloud)));
    }
    voxels = map.live().voxels().size();
    before = drawn(map.live());
  }
  const double began = bench::processor_ms();
  LastingMap map(wide_map(), folder);
  const double read = bench::processor_ms();
  double last = read;
  double longest_ms = 0.0;
  const LastingMap::Beginning beginning = map.begin_with(aisle.scan(), [&] {
    const double now = bench::processor_ms();
    longest_ms = std::max(longest_ms, now - std::exchange(last, now));
  });
  const double now = bench::processor_ms();
  longest_ms = std::max(longest_ms, now - last);
  const double spent_ms = now - began;
  const double ms_per_million = spent_ms / (1e-6 * static_cast<double>(voxels));
  std::printf("%s; %zu points: %.0f ms of a processor, %.1f s per million voxels\n", beginning.note.c_str(),
              map.live().clouds().points(), spent_ms, 1e-3 * ms_per_million);
  EXPECT_EQ(map.live().voxels().size(), voxels);
  EXPECT_GT(voxels, 300'000U) << "not large";
  EXPECT_LT(ms_per_million, kMostMsPerMillion);
  std::printf("longest without a word to the watchdog: %.0f of %.0f ms\n", longest_ms, now - read);
  EXPECT_LT(longest_ms, 0.25 * (now - read)) << "a map ten times as large would starve its watchdog (row P7)";
  EXPECT_EQ(drawn(map.live()), before);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace ignis
