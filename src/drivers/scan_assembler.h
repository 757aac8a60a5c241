// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "common/measurements.h"
#include "drivers/body_mount.h"

namespace ignis::l1 {

/// Groups packets into scans of `packets_per_scan` consecutive counts. The places of a scan are fixed by the counter,
/// so a missing packet leaves a hole and never stretches the scan.
class ScanAssembler {
 public:
  explicit ScanAssembler(int packets_per_scan) : packets_per_scan_(packets_per_scan) {}

  /// Adds packet `count`, whose first point was measured at `time_us`. Counts go up. Returns the scans that this ends:
  /// the one before it when it opens a new one, and its own when it takes the last place.
  [[nodiscard]] std::vector<Scan> add(std::int64_t count, double time_us, const std::vector<BodyPoint>& points);

  /// Ends a scan whose last place should have been filled 20 ms before `time_us`.
  [[nodiscard]] std::optional<Scan> end_if_overdue(double time_us);

  /// Ends the open scan, if any, because the stream is over: places after the newest packet are not missing.
  [[nodiscard]] std::optional<Scan> end();

 private:
  struct TimedPoint {
    double time_us;
    Eigen::Vector3f position;
    float intensity;
  };
  [[nodiscard]] Scan close(std::int64_t expected_end);
  [[nodiscard]] std::int64_t end_of_scan() const { return (scan_ + 1) * packets_per_scan_; }
  [[nodiscard]] std::int64_t scan_of(std::int64_t count) const;

  int packets_per_scan_;
  std::int32_t sequence_ = 0;
  bool open_ = false;
  std::int64_t scan_ = 0;         ///< number of the open scan, by the counter
  std::int64_t first_count_ = 0;  ///< place from which packets are expected
  double first_time_us_ = 0.0;
  double newest_time_us_ = 0.0;
  std::int64_t newest_count_ = 0;
  int packets_ = 0;
  bool ever_opened_ = false;
  std::vector<TimedPoint> points_;
};

}  // namespace ignis::l1
