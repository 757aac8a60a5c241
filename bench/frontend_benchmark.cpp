// SPDX-License-Identifier: Apache-2.0
//
// The kernels of the front end, one scan's worth per iteration, for an L1 (1,000 points) and for 128 beams (130,000).
// Items are points unless said otherwise. The figures in the comments are CPU time on a virtual machine of 2.6 GHz with
// 2 MB of second-level cache, busy with other work: good to a fifth. Run on one core:
//   taskset -c 1 build/release/bin/frontend_benchmark --benchmark_repetitions=5 --benchmark_report_aggregates_only=true

#include <algorithm>

#include <benchmark/benchmark.h>

#include "frontend/filter/eskf.h"
#include "frontend/local_map/neighbour_search.h"
#include "frontend/local_map/voxel_downsample.h"
#include "frontend/matching/deskew.h"
#include "frontend/matching/scan_matcher.h"
#include "frontend/matching/scan_update.h"
#include "frontend/planes/four_planes.h"
#include "frontend/planes/plane_fit.h"
#include "recorded_drive.h"

namespace ignis::bench {
namespace {

/// A prediction as good as one between two scans: 5 mm, 0.5 mrad.
FilterState prediction(const RecordedDrive& drive) {
  FilterState filter{.nominal = drive.states.back()};
  filter.covariance = ErrorCovariance::Identity() * 1e-6;
  filter.covariance.block<3, 3>(kPosition, kPosition) *= 25.0;
  filter.covariance.block<3, 3>(kVelocity, kVelocity) *= 100.0;
  filter.nominal.T_odom_body.translation += Eigen::Vector3d(0.004, -0.002, 0.002);
  return filter;
}

template <class Points>
void count(benchmark::State& state, const Points& points) {
  state.SetItemsProcessed(state.iterations() * std::ssize(points));
  state.counters["points"] = static_cast<double>(points.size());
}

// Bound by arithmetic: some fifty operations for a point with an instant of its own, a small rotation as a series; 18
// for one of a spinning LiDAR's column, which share a matrix. Large scans are thinned first, so that all their points
// never come here.
void deskew_scan(benchmark::State& state, const std::string& sensor) {
  const RecordedDrive& drive = recorded_drive(sensor);
  const Scan& scan = drive.scans.back();
  Deskewer deskewer;
  std::vector<CloudPoint> cloud;
  for (auto _ : state) {
    deskewer.deskew(scan, drive.states.back(), drive.imu, drive.config.gravity_m, cloud);
    benchmark::DoNotOptimize(cloud.data());
  }
  count(state, scan.points);
}

// Some 60 operations a point and one jump that is foreseen wrongly now and then; the lines of the table are asked for
// a batch ahead. The points alone would stream in 0.4 ms for 128 beams.
void downsample_scan(benchmark::State& state, const std::string& sensor) {
  const RecordedDrive& drive = recorded_drive(sensor);
  const std::vector<CloudPoint> cloud = last_cloud(drive);
  VoxelThinner thinner;
  for (auto _ : state) {
    benchmark::DoNotOptimize(thinner.pick(std::span<const CloudPoint>(cloud), drive.config.voxel_size_m));
  }
  count(state, cloud);
}

// In voxels that the scan has met before. The chain table, region, block is walked where the scan enters another block;
// head, row and weight of the block, a cache line each, are asked for a batch ahead.
void insert_into_map(benchmark::State& state, const std::string& sensor) {
  const RecordedDrive& drive = recorded_drive(sensor);
  LocalMap map = map_before_last(drive);
  const std::vector<CloudPoint> cloud = last_cloud(drive);
  for (auto _ : state) map.insert(cloud, drive.states.back().T_odom_body, true);
  count(state, cloud);
  state.counters["voxels"] = map.size();
}

// 11 to 13 neighbours in five to eight rows of four voxels, 25 vector operations and one cache line each. Of one query
// alone half of the time is waiting for two of these lines, one after the other.
void gather_neighbours(benchmark::State& state, const std::string& sensor) {
  const RecordedDrive& drive = recorded_drive(sensor);
  const LocalMap map = map_before_last(drive);
  const std::vector<Eigen::Vector3f> points = last_thinned(drive);
  const Pose& T_odom_body = drive.states.back().T_odom_body;
  double neighbours = 0.0;
  for (auto _ : state) {
    neighbours = 0.0;
    for (const Eigen::Vector3f& point : points) {
      neighbours += map.gather(T_odom_body * point.cast<double>().eval()).count;
    }
    benchmark::DoNotOptimize(neighbours);
  }
  count(state, points);
  state.counters["neighbours"] = neighbours / static_cast<double>(points.size());
}

// The same as the matcher does it: sixteen queries together, lines asked for ahead.
void search_neighbours(benchmark::State& state, const std::string& sensor) {
  const RecordedDrive& drive = recorded_drive(sensor);
  const LocalMap map = map_before_last(drive);
  std::vector<Eigen::Vector3d> queries;
  for (const Eigen::Vector3f& point : last_thinned(drive)) {
    queries.emplace_back(drive.states.back().T_odom_body * point.cast<double>().eval());
  }
  NeighbourSearch search;
  for (auto _ : state) benchmark::DoNotOptimize(search.gather(map, queries, drive.config.match_radius_m).data());
  count(state, queries);
}

/// As the scans after it would do it, until all of the map has been looked at and what is beyond the window is gone.
void sweep_around(LocalMap& map, const Eigen::Vector3d& position) {
  const int none_is_sure = map.scans() + 1;
  for (int i = 0; i < LocalMap::kSlidesToSweep; ++i) map.slide(position, none_is_sure);
}

// 26 ns a voxel of a map of which half goes, as after a whole window; 3 ns where nearly nothing does: a stream over all
// blocks, the place of each that goes taken by the last one, and the table built anew. It happens every quarter of a
// window, 5 m (L1) or 20 m, spread over 16 scans, whose calls are counted together here.
void slide_map(benchmark::State& state, const std::string& sensor) {
  const RecordedDrive& drive = recorded_drive(sensor);
  const LocalMap full = map_before_last(drive);
  const Eigen::Vector3d ahead = drive.states.back().T_odom_body * Eigen::Vector3d(0, 0, -drive.config.map_window_m);
  int left = 0;
  for (auto _ : state) {
    state.PauseTiming();
    LocalMap map = full;
    sweep_around(map, drive.states.back().T_odom_body.translation);
    state.ResumeTiming();
    sweep_around(map, ahead);
    left = map.size();
  }
  state.SetItemsProcessed(state.iterations() * full.size());
  state.counters["voxels"] = full.size();
  state.counters["left"] = left;
}

/// The neighbourhoods of the last scan's points, four by four.
std::vector<FourMoments> moments_of_last_scan(const RecordedDrive& drive) {
  const LocalMap map = map_before_last(drive);
  std::vector<Eigen::Vector3d> queries;
  for (const Eigen::Vector3f& point : last_thinned(drive)) {
    queries.emplace_back(drive.states.back().T_odom_body * point.cast<double>().eval());
  }
  NeighbourSearch search;
  const std::span<const FourMoments> moments = search.gather(map, queries, drive.config.match_radius_m);
  return {moments.begin(), moments.end()};
}

void report_planes(benchmark::State& state, std::span<const PlaneFit> planes) {
  state.SetItemsProcessed(state.iterations() * std::ssize(planes));
  const auto found = std::ranges::count(planes, PlaneVerdict::kPlane, &PlaneFit::verdict);
  state.counters["planes"] = static_cast<double>(found) / static_cast<double>(planes.size());
}

// The reference: a third is steps to the smallest eigenvalue, each waiting for a division; the rest is cross products
// and roots.
void fit_plane_to_each(benchmark::State& state, const std::string& sensor) {
  const RecordedDrive& drive = recorded_drive(sensor);
  const std::vector<FourMoments> moments = moments_of_last_scan(drive);
  std::vector<PlaneFit> planes;
  for (auto _ : state) {
    planes.clear();
    for (const FourMoments& four : moments) {
      for (int k = 0; k < kLanes; ++k) planes.push_back(fit_plane(four.of(k), drive.config));
    }
    benchmark::DoNotOptimize(planes.data());
  }
  report_planes(state, planes);
}

// The same in single precision, four together: the waits are shared, and what is left is some 250 operations on four
// planes and writing 4 x 170 bytes.
void fit_planes_to_each_four(benchmark::State& state, const std::string& sensor) {
  const RecordedDrive& drive = recorded_drive(sensor);
  const std::vector<FourMoments> moments = moments_of_last_scan(drive);
  std::vector<PlaneFit> planes(kLanes * moments.size());
  for (auto _ : state) {
    for (std::size_t i = 0; i < moments.size(); ++i) {
      const auto plane = [&](std::size_t k) { return &planes[kLanes * i + k]; };
      const std::array<PlaneFit*, kLanes> four = {plane(0), plane(1), plane(2), plane(3)};
      fit_four_planes(moments[i], drive.config, drive.config.match_radius_m, four);
    }
    benchmark::DoNotOptimize(planes.data());
  }
  report_planes(state, planes);
}

// Most of it neighbourhood search and plane fit, met once as long as the iterate stays; the passes over
// the constraints add some 100 ns a point each. Proportional to the points that go in, hence max_scan_points: a match
// of 130,000 points costs no more than the 10,000 that last_thinned leaves.
void match_scan(benchmark::State& state, const std::string& sensor) {
  const RecordedDrive& drive = recorded_drive(sensor);
  const LocalMap map = map_before_last(drive);
  const std::vector<Eigen::Vector3f> points = last_thinned(drive);
  const FilterState predicted = prediction(drive);
  ScanMatcher matcher(drive.config);
  if (matcher.match(predicted, predicted.nominal.T_odom_body, points, map).stats.reason != ScanReason::kApplied) {
    state.SkipWithError("the scan was not applied");
  }
  for (auto _ : state) benchmark::DoNotOptimize(matcher.match(predicted, predicted.nominal.T_odom_body, points, map));
  count(state, points);
}

// 1.9 us: F P F^T as two dense products of 15x15 is 13,500 operations, 7.3 per nanosecond and a third of what the two
// 128-bit units of the portable instruction set could do. F is mostly zero and one: its blocks alone are a quarter of
// it. Items are IMU samples.
void predict_step(benchmark::State& state) {
  const RecordedDrive& drive = recorded_drive("l1");
  const FilterState start = prediction(drive);
  const InertialInput input = midpoint(drive.imu[drive.imu.size() - 2], drive.imu.back());
  constexpr int kSteps = 250;
  for (auto _ : state) {
    // From the same start again each second of data: left alone, the covariance would grow without bound.
    FilterState filter = start;
    for (int i = 0; i < kSteps; ++i) predict(filter, input, 0.004, drive.config);
    benchmark::DoNotOptimize(filter);
  }
  state.SetItemsProcessed(state.iterations() * kSteps);
}

// 2.7 us whatever the number of points, three products of 15x15 and one 6x6 solve: nothing beside the match.
// Items are steps of the iterated update.
void update_step(benchmark::State& state) {
  const RecordedDrive& drive = recorded_drive("l1");
  const FilterState filter = prediction(drive);
  PoseInformation constraints;
  for (int i = 0; i < 1000; ++i) {
    const double angle = 0.1 * i;
    Vector6d h;
    h << std::sin(angle), std::cos(2 * angle), std::sin(3 * angle), std::cos(angle), std::sin(2 * angle), 0.5;
    constraints.add(h, 0.01 * std::sin(7 * angle), 1e-4);
  }
  const ErrorVector deviation = ErrorVector::Constant(1e-4);
  for (auto _ : state) benchmark::DoNotOptimize(information_update(filter.covariance, deviation, constraints));
  state.SetItemsProcessed(state.iterations());
}

// How the two dearest kernels grow, for bench/scaling.py: a match with the points that go in, as far as they go in at
// all (max_scan_points), and a search with the size of the map.
void match_points(benchmark::State& state) {
  const RecordedDrive& drive = recorded_drive("spinning128");
  const LocalMap map = map_before_last(drive);
  const std::vector<CloudPoint> cloud = last_cloud(drive);
  const auto wanted = static_cast<std::size_t>(state.range(0));
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < wanted; ++i) points.push_back(cloud[i * cloud.size() / wanted].position);
  const FilterState predicted = prediction(drive);
  ScanMatcher matcher(drive.config);
  for (auto _ : state) benchmark::DoNotOptimize(matcher.match(predicted, predicted.nominal.T_odom_body, points, map));
  count(state, points);
}

void gather_in_floor(benchmark::State& state) {
  FrontendConfig config;
  config.map_window_m = 200.0;
  LocalMap map(config);
  const auto edge = static_cast<int>(state.range(0));
  std::vector<Eigen::Vector3f> points;
  for (int i = -edge / 2; i < edge / 2; ++i) {
    for (int j = -edge / 2; j < edge / 2; ++j) {
      const Eigen::Vector2d at = config.voxel_size_m * Eigen::Vector2d(i + 0.5, j + 0.5);
      points.emplace_back(static_cast<float>(at.x()), 0.1F, static_cast<float>(at.y()));
    }
  }
  map.insert(points, {}, true);
  // Far apart from one to the next, as the points of a scan are.
  std::size_t at = 0;
  for (auto _ : state) {
    at = (at + 7919) % points.size();
    benchmark::DoNotOptimize(map.gather(points[at].cast<double>(), 0.5));
  }
  state.SetItemsProcessed(state.iterations());
  state.counters["voxels"] = map.size();
}

#define IGNIS_BOTH_SENSORS(kernel)                                                 \
  BENCHMARK_CAPTURE(kernel, l1, std::string("l1"))->Unit(benchmark::kMicrosecond); \
  BENCHMARK_CAPTURE(kernel, spinning128, std::string("spinning128"))->Unit(benchmark::kMicrosecond)

IGNIS_BOTH_SENSORS(deskew_scan);
IGNIS_BOTH_SENSORS(downsample_scan);
IGNIS_BOTH_SENSORS(insert_into_map);
IGNIS_BOTH_SENSORS(gather_neighbours);
IGNIS_BOTH_SENSORS(search_neighbours);
IGNIS_BOTH_SENSORS(slide_map);
IGNIS_BOTH_SENSORS(fit_plane_to_each);
IGNIS_BOTH_SENSORS(fit_planes_to_each_four);
IGNIS_BOTH_SENSORS(match_scan);
BENCHMARK(predict_step);
BENCHMARK(update_step);
BENCHMARK(match_points)->RangeMultiplier(2)->Range(250, 8000)->Unit(benchmark::kMicrosecond);
BENCHMARK(gather_in_floor)->RangeMultiplier(2)->Range(64, 1024);

}  // namespace
}  // namespace ignis::bench
