// SPDX-License-Identifier: Apache-2.0
//
// What must not pile up in the odometry while it waits for something. Its memory is measured by its checkpoint.
#include <gtest/gtest.h>

#include "frontend/checkpoint.h"
#include "frontend/fault_drive.h"

namespace ignis {
namespace {

using test::Drive;
using test::drive;
using test::Sensors;
using test::Watched;

/// Bytes of the checkpoint of a vehicle that stands, so that its map grows no more, and whose IMU has been gone for so
/// long.
std::size_t checkpoint_size_without_imu(double seconds) {
  static const Drive stand = test::simulate(test::furnished_hall(), test::straight_drive(10.0, 0.0), 4.0, Sensors{}, 3);
  Drive input = stand;
  for (int i = 0; i < static_cast<int>(20.0 * seconds); ++i) {
    Scan& next = input.scans.emplace_back(input.scans[input.scans.size() - 20]);
    next.utime += kMicrosPerSecond;
  }
  const Watched run(input);
  EXPECT_TRUE(run.scans.back().has_state);
  EXPECT_GT(run.scans.back().stats.utime, input.scans.back().utime - kMicrosPerSecond) << "scans go on without it";
  return encode_checkpoint(run.lio, "").size();
}

TEST(Fault_F2, AnImuGoneForGoodCostsNoMemory) {
  // A minute of samples that stand in for it are 6,000, of 65 bytes each.
  EXPECT_LT(checkpoint_size_without_imu(70.0), checkpoint_size_without_imu(10.0) + 65 * 1500);
}

TEST(Fault_F5, AStartThatIsWaitedForCostsNoMemory) {
  Lio lio(test::tuned_config());
  ImuSample sample = drive().imu.front();
  for (int i = 0; i < 10'000; ++i) {
    sample.utime += 4'000;
    sample.gyro.y() = i % 2 == 0 ? 0.5 : -0.5;  // never still
    (void)lio.add_imu(sample);
  }
  ASSERT_FALSE(lio.status().running);
  EXPECT_LT(encode_checkpoint(lio, "").size(), 65 * 2'000U) << "40 s of samples, of 65 bytes each";
}

}  // namespace
}  // namespace ignis
