// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "common/measurements.h"
#include "ignis/imu_t.hpp"
#include "ignis/scan_t.hpp"
#include "messages/part_assembler.h"

/// L1_IMU and L1_SCAN.
namespace ignis::messages {

/// `temperature` in degrees Celsius, kUnknownTemperature when the sensor does not tell.
inline constexpr float kUnknownTemperature = -1000.0F;
[[nodiscard]] imu_t to_message(const ImuSample& sample, float temperature = kUnknownTemperature);
[[nodiscard]] ImuSample from_message(const imu_t& message);

/// A scan as one message, or as numbered parts when it does not fit one datagram.
[[nodiscard]] std::vector<scan_t> to_messages(const Scan& scan);

/// What stands at the front of an encoded L1_SCAN.
struct ScanHead {
  Utime utime = 0;  ///< [us] of the first point
  std::int32_t sequence = 0;
  std::int16_t part = 0;
  std::int16_t part_count = 0;
};

/// Reads the head without the points; nothing where decode_checked() would refuse the message.
[[nodiscard]] std::optional<ScanHead> read_scan_head(std::span<const std::byte> data);

/// Puts scans together straight from encoded parts whose bytes stay where they are, such as those of a mapped log: the
/// points are read once, from the log into the scan. What comes out is what ScanAssembler makes of the decoded parts.
class EncodedScanAssembler {
 public:
  /// A complete scan, or nothing yet or not from what read_scan_head() refuses. `data` has to outlive the parts that
  /// are still waited for.
  [[nodiscard]] std::optional<Scan> add(std::span<const std::byte> data);

 private:
  struct Part {
    std::int32_t sequence = 0;
    std::int16_t part = 0;
    std::int16_t part_count = 0;
    std::span<const std::byte> body;  ///< behind the fingerprint
  };

  PartAssembler<Part> parts_;
};

/// Puts the parts of scans together again.
class ScanAssembler {
 public:
  /// A complete scan, or nothing yet.
  [[nodiscard]] std::optional<Scan> add(const scan_t& part);
  [[nodiscard]] std::int64_t incomplete() const { return parts_.incomplete(); }

 private:
  PartAssembler<scan_t> parts_;
};

}  // namespace ignis::messages
