// SPDX-License-Identifier: Apache-2.0
//
// The map: insertion, pictures, frames and rebuilds over a warehouse of racks, as an L1 with 15 m range would see it.
// Items are points unless said otherwise; quantiles are CPU time. Run on one core:
//   taskset -c 1 build/release/bin/map_benchmark --benchmark_repetitions=5 --benchmark_report_aggregates_only=true

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include <time.h>

#include <benchmark/benchmark.h>

#include "common/frames.h"
#include "map/live_map.h"
#include "map/picture_builder.h"
#include "map/stream_encoding.h"

namespace ignis::bench {
namespace {

constexpr double kRange = 15.0;
constexpr double kFloor = -0.5;
constexpr double kRackSpacing = 6.0;
constexpr double kRackHeight = 3.0;

/// Points on the floor and on the faces of endless racks along Z, within range of the pose; body frame.
std::vector<CloudPoint> scan_of_racks(std::mt19937& generator, const Pose& T_world_body, std::size_t count) {
  std::uniform_real_distribution<double> around(-kRange, kRange);
  std::uniform_real_distribution<double> height(kFloor, kRackHeight);
  std::vector<CloudPoint> cloud;
  const Pose T_body_world = T_world_body.inverse();
  while (cloud.size() < count) {
    Eigen::Vector3d p = T_world_body.translation + Eigen::Vector3d(around(generator), 0.0, around(generator));
    if (generator() % 3 == 0) {
      p.y() = kFloor;
    } else {
      p.x() = kRackSpacing * std::round(p.x() / kRackSpacing) + 0.6 * (generator() % 2 == 0 ? 1.0 : -1.0);
      p.y() = height(generator);
    }
    if ((p - T_world_body.translation).norm() > kRange) continue;
    cloud.push_back({(T_body_world * p).cast<float>(), static_cast<float>(generator() % 256)});
  }
  return cloud;
}

Pose pose_on_way(double metres) {
  // Up and down the aisles of a hall of 200 m by 200 m.
  const double lane = std::floor(metres / 200.0);
  const double along = metres - 200.0 * lane;
  const bool up = std::fmod(lane, 2.0) == 0.0;
  return {frames::from_yaw_pitch_roll({up ? 0.0 : 3.14159, 0.0, 0.0}),
          {kRackSpacing * lane + 3.0, 0.0, up ? -along : along - 200.0}};
}

Keyframe keyframe(std::mt19937& generator, std::int32_t id, const Pose& pose, std::size_t points) {
  Keyframe keyframe;
  keyframe.id = id;
  keyframe.state.T_odom_body = pose;
  keyframe.cloud = scan_of_racks(generator, pose, points);
  return keyframe;
}

constexpr std::size_t kScanPoints = 1'000;  // of an L1 at 20 Hz
constexpr double kKeyframeSpacing = 4.0;
constexpr std::size_t kKeyframePoints = 10'000;  // with all its scans

/// A hall driven through: `keyframes` of them.
std::unique_ptr<LiveMap> driven_hall(int keyframes, const MapConfig& config = {}) {
  std::mt19937 generator(1);
  auto map = std::make_unique<LiveMap>(config);
  for (int id = 0; id < keyframes; ++id) {
    const Pose pose = pose_on_way(kKeyframeSpacing * id);
    map->insert_scan({}, pose);
    map->add_keyframe(keyframe(generator, id, pose, kKeyframePoints));
  }
  return map;
}

/// The hall of 400 keyframes that the benchmarks below share and drive on in.
LiveMap& hall() {
  static const std::unique_ptr<LiveMap> map = driven_hall(400);
  return *map;
}

/// CPU time of this thread [ms]: the machine may be busy with other work.
double cpu_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

void report_quantiles(benchmark::State& state, std::vector<double> milliseconds) {
  std::ranges::sort(milliseconds);
  const auto at = [&](double ratio) {
    return milliseconds[static_cast<std::size_t>(ratio * static_cast<double>(milliseconds.size() - 1))];
  };
  state.counters["p50_ms"] = at(0.5);
  state.counters["p99_ms"] = at(0.99);
}

// What a standing or slow vehicle does: all points fall into cells that the open keyframe has filled.
void insert_known_scan(benchmark::State& state) {
  std::mt19937 generator(2);
  const auto map = driven_hall(50);
  const Pose pose = pose_on_way(kKeyframeSpacing * 49);
  const std::vector<CloudPoint> scan = scan_of_racks(generator, pose, kScanPoints);
  for (auto _ : state) benchmark::DoNotOptimize(map->insert_scan(scan, pose));
  state.SetItemsProcessed(state.iterations() * std::ssize(scan));
}
BENCHMARK(insert_known_scan);

// The first scans of a new keyframe in a place that the map knows: new to the keyframe, offered to all three levels.
void insert_scan_into_known_place(benchmark::State& state) {
  std::mt19937 generator(3);
  const auto map = driven_hall(50);
  const Pose pose = pose_on_way(kKeyframeSpacing * 49);
  const std::vector<CloudPoint> scan = scan_of_racks(generator, pose, 20 * kScanPoints);
  std::int32_t id = 50;
  for (auto _ : state) {
    state.PauseTiming();
    map->add_keyframe(keyframe(generator, id++, pose, 0));
    state.ResumeTiming();
    benchmark::DoNotOptimize(map->insert_scan(scan, pose));
  }
  state.SetItemsProcessed(state.iterations() * std::ssize(scan));
}
BENCHMARK(insert_scan_into_known_place)->Iterations(60);

// A cloud into an empty map: every point makes voxels, tables grow.
void insert_into_empty_map(benchmark::State& state) {
  std::mt19937 generator(4);
  const std::vector<CloudPoint> cloud = scan_of_racks(generator, Pose{}, 100'000);
  for (auto _ : state) {
    ThreeLevelMap map(MapConfig{});
    map.add_cloud(0, Pose{});
    benchmark::DoNotOptimize(map.insert(0, cloud));
  }
  state.SetItemsProcessed(state.iterations() * std::ssize(cloud));
}
BENCHMARK(insert_into_empty_map);

// The levels alone, without the keyframe's own cells: the same cloud again.
void insert_into_known_voxels(benchmark::State& state) {
  std::mt19937 generator(4);
  const std::vector<CloudPoint> cloud = scan_of_racks(generator, Pose{}, 100'000);
  ThreeLevelMap map(MapConfig{});
  map.add_cloud(0, Pose{});
  for (auto _ : state) benchmark::DoNotOptimize(map.insert(0, cloud));
  state.SetItemsProcessed(state.iterations() * std::ssize(cloud));
}
BENCHMARK(insert_into_known_voxels);

// Two scans at 2 m/s, then the picture of 25 m: what the process does ten times a second. Manual time: the picture
// alone.
void picture_while_driving(benchmark::State& state) {
  std::mt19937 generator(5);
  LiveMap* const map = &hall();
  PictureBuilder builder(static_cast<double>(state.range(0)));
  double metres = kKeyframeSpacing * 300;  // through known aisles
  static std::int32_t id = 1'000;
  std::vector<double> times;
  std::size_t voxels = 0;
  for (auto _ : state) {
    for (int i = 0; i < 2; ++i) {
      metres += 0.1;
      const Pose pose = pose_on_way(metres);
      if (std::fmod(metres, kKeyframeSpacing) < 0.1) map->add_keyframe(keyframe(generator, id++, pose, 3'000));
      map->insert_scan(scan_of_racks(generator, pose, kScanPoints), pose);
    }
    const double began = cpu_milliseconds();
    const MapPicture picture = builder.build(map->voxels());
    times.push_back(cpu_milliseconds() - began);
    state.SetIterationTime(1e-3 * times.back());
    voxels = picture.counts[0] + picture.counts[1] + picture.counts[2];
  }
  report_quantiles(state, times);
  state.counters["voxels"] = static_cast<double>(voxels);
}
BENCHMARK(picture_while_driving)->Arg(25)->Arg(100)->UseManualTime()->Iterations(500)->Unit(benchmark::kMillisecond);

// A picture with nothing to take over: the first one of a viewer.
void first_picture(benchmark::State& state) {
  LiveMap* const map = &hall();
  std::vector<double> times;
  for (auto _ : state) {
    const double began = cpu_milliseconds();
    benchmark::DoNotOptimize(PictureBuilder(static_cast<double>(state.range(0))).build(map->voxels()));
    times.push_back(cpu_milliseconds() - began);
  }
  report_quantiles(state, times);
}
BENCHMARK(first_picture)->Arg(25)->Arg(100)->Unit(benchmark::kMillisecond);

void encode_a_snapshot(benchmark::State& state) {
  LiveMap* const map = &hall();
  const MapPicture picture = PictureBuilder(static_cast<double>(state.range(0))).build(map->voxels());
  for (auto _ : state) benchmark::DoNotOptimize(encode_snapshot(picture));
  state.counters["bytes"] = static_cast<double>(snapshot_bytes(picture));
}
BENCHMARK(encode_a_snapshot)->Arg(10)->Arg(25)->Arg(50)->Arg(100)->Unit(benchmark::kMillisecond);

// The windows move on by half a metre through a known place: what enters is filled from the stored clouds.
void slide_through_a_known_place(benchmark::State& state) {
  LiveMap* const map = &hall();
  double metres = 0.0;
  std::vector<double> times;
  for (auto _ : state) {
    metres += 0.5;
    const double began = cpu_milliseconds();
    map->insert_scan({}, pose_on_way(metres));
    times.push_back(cpu_milliseconds() - began);
    state.SetIterationTime(1e-3 * times.back());
  }
  report_quantiles(state, times);
}
BENCHMARK(slide_through_a_known_place)->UseManualTime()->Iterations(500)->Unit(benchmark::kMillisecond);

// The newest keyframe moves a little, as it does with every revision of the graph.
void reanchor_the_newest_keyframe(benchmark::State& state) {
  LiveMap* const map = &hall();
  map->insert_scan({}, pose_on_way(kKeyframeSpacing * 399));
  std::vector<double> times;
  int sign = 1;
  for (auto _ : state) {
    CorrectedPose moved{399, pose_on_way(kKeyframeSpacing * 399)};
    moved.T_map_keyframe.translation.x() += 0.01 * (sign = -sign);
    const double began = cpu_milliseconds();
    map->correct(Pose{}, std::span(&moved, 1));
    times.push_back(cpu_milliseconds() - began);
  }
  report_quantiles(state, times);
}
BENCHMARK(reanchor_the_newest_keyframe)->Unit(benchmark::kMillisecond);

// All keyframes at new poses. Items are keyframes.
void rebuild_all(benchmark::State& state) {
  const auto keyframes = static_cast<int>(state.range(0));
  const auto map = driven_hall(keyframes);
  const RebuildJob job = map->begin_rebuild();
  for (auto _ : state) benchmark::DoNotOptimize(rebuild(job));
  state.SetItemsProcessed(state.iterations() * keyframes);
  state.counters["points"] = static_cast<double>(map->clouds().points());
  state.counters["voxels"] = static_cast<double>(map->voxels().size());
  state.counters["bytes"] = static_cast<double>(map->voxels().bytes() + map->clouds().bytes());
}
BENCHMARK(rebuild_all)->Arg(125)->Arg(250)->Arg(500)->Arg(1000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace ignis::bench
