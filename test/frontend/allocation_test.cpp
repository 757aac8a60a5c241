// SPDX-License-Identifier: Apache-2.0
//
// How often the front end asks for memory while it works on a scan. A program of its own, since it counts by replacing
// the global operator new.

#include <algorithm>
#include <cstdlib>
#include <new>
#include <span>

#include <gtest/gtest.h>

#include "frontend/lio_runner.h"
#include "frontend/local_map/voxel_downsample.h"
#include "frontend/matching/deskew.h"
#include "frontend/matching/scan_matcher.h"
#include "frontend/matching/scan_selection.h"

namespace {

int allocations = 0;

void* counted(std::size_t bytes, std::size_t alignment) {
  ++allocations;
  void* memory = std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t bytes) { return counted(bytes, alignof(std::max_align_t)); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return counted(bytes, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(bytes);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace ignis {
namespace {

/// Six seconds of a standing sensor in a hall.
const test::Drive& standing_drive() {
  static const test::Drive drive =
      test::simulate(test::furnished_hall(), test::straight_drive(10.0, 0.0), 6.0, test::Sensors{}, 3);
  return drive;
}

/// What Lio does with a scan, without what it hands out.
class ScanPath {
 public:
  explicit ScanPath(const FrontendConfig& config) : config_(config), selector_(config), matcher_(config), map_(config) {
    filter_.covariance.diagonal().setConstant(1e-6);
  }

  void process(const Scan& scan) {
    const ScanSelection& selection = selector_.select(scan);
    deskewer_.deskew(selection.scan, filter_.nominal, standing_drive().imu, config_.gravity_m, cloud_);
    sparse_voxels_ = thinner_.pick(std::span<const CloudPoint>(cloud_), config_.voxel_size_m).size();
    every_nth(cloud_, config_.max_scan_points, points_);
    if (!map_.empty()) matched_ += matcher_.match(filter_, Pose(), points_, map_).stats.applied() ? 1 : 0;
    map_.insert(cloud_, Pose(), true);
    map_.slide(Eigen::Vector3d::Zero(), 0);
  }

  [[nodiscard]] int matched() const { return matched_; }
  [[nodiscard]] std::size_t sparse_voxels() const { return sparse_voxels_; }

 private:
  FrontendConfig config_;
  ScanSelector selector_;
  Deskewer deskewer_;
  VoxelThinner thinner_;
  ScanMatcher matcher_;
  LocalMap map_;
  FilterState filter_;
  std::vector<CloudPoint> cloud_;
  std::vector<Eigen::Vector3f> points_;
  std::size_t sparse_voxels_ = 0;
  int matched_ = 0;
};

/// Allocations of a second pass over the same scans, after which nothing is new.
int allocations_in_steady_state(const FrontendConfig& config) {
  ScanPath path(config);
  for (const Scan& scan : standing_drive().scans) path.process(scan);
  const int matched = path.matched();
  allocations = 0;
  for (const Scan& scan : standing_drive().scans) path.process(scan);
  const int counted = allocations;
  EXPECT_EQ(path.matched() - matched, std::ssize(standing_drive().scans)) << "every scan went the whole way";
  EXPECT_GT(path.sparse_voxels(), 100U);
  return counted;
}

TEST(Allocations, TheScanPathMakesNoneInSteadyState) {
  EXPECT_EQ(allocations_in_steady_state(test::tuned_config()), 0);
}

TEST(Allocations, NorDoesItWhenScansAreThinnedFirst) {
  FrontendConfig config = test::tuned_config();
  config.max_scan_points = 400;
  config.scan_voxel_m = 0.05;
  EXPECT_EQ(allocations_in_steady_state(config), 0);
}

TEST(Allocations, LioMakesThoseOfWhatItHandsOut) {
  Lio lio(test::tuned_config());
  std::vector<int> per_scan;
  std::size_t next = 0;
  for (const ImuSample& sample : standing_drive().imu) {
    (void)lio.add_imu(sample);
    if (next == standing_drive().scans.size() || standing_drive().scans[next].end_utime() > sample.utime) continue;
    Scan scan = standing_drive().scans[next++];
    allocations = 0;
    const std::vector<ScanResult> results = lio.add_scan(std::move(scan));
    const int counted = allocations;
    ASSERT_EQ(results.size(), 1U);
    if (results[0].stats.applied() && !results[0].keyframe) per_scan.push_back(counted);
  }
  ASSERT_GT(per_scan.size(), 50U);
  const std::span<const int> settled = std::span(per_scan).last(per_scan.size() - 25);  // its buffers have grown
  // The list of results, the cloud in it, and the thinned cloud that waits for the next keyframe.
  EXPECT_EQ(std::ranges::min(settled), 3);
  EXPECT_GT(2 * std::ranges::count(settled, 3), std::ssize(settled)) << "most scans";
  // Now and then a block of a queue, of scans, thinned clouds or inertial samples.
  EXPECT_LE(std::ranges::max(settled), 6);
}

}  // namespace
}  // namespace ignis
