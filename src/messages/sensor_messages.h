// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
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

/// An L1_SCAN as it came: its head, and the bytes of the message. Takes the place of scan_t where messages are
/// received.
struct ScanPart : ScanHead {
  std::span<const std::byte> data;

  [[nodiscard]] static std::int64_t getHash() { return scan_t::getHash(); }
  /// False where decode_checked() would refuse the message.
  [[nodiscard]] bool read(std::span<const std::byte> from);
};

/// All parts of a scan, whose points have not been read yet.
class EncodedScan {
 public:
  using Bodies = std::vector<std::span<const std::byte>>;  ///< of the messages, behind the fingerprint

  EncodedScan(Bodies bodies, std::vector<std::shared_ptr<const void>> owners)
      : bodies_(std::move(bodies)), owners_(std::move(owners)) {}

  [[nodiscard]] Scan read() const;
  /// The same without points.
  [[nodiscard]] Scan read_frame() const;

 private:
  Bodies bodies_;
  std::vector<std::shared_ptr<const void>> owners_;
};

/// Puts scans together straight from encoded parts: the points are read once, from the bytes into the scan. What comes
/// out is what the generated decoder would make of them.
class EncodedScanAssembler {
 public:
  /// A complete scan, or nothing yet or not from what read_scan_head() refuses. `data` has to outlive the scan, as a
  /// mapped log does, or `owner` is what keeps it.
  [[nodiscard]] std::optional<EncodedScan> add(std::span<const std::byte> data,
                                               std::shared_ptr<const void> owner = nullptr);
  [[nodiscard]] std::int64_t incomplete() const { return parts_.incomplete(); }

 private:
  struct Part {
    std::int32_t sequence = 0;
    std::int16_t part = 0;
    std::int16_t part_count = 0;
    std::span<const std::byte> body;  ///< behind the fingerprint
    std::shared_ptr<const void> owner;
  };

  PartAssembler<Part> parts_;
};

}  // namespace ignis::messages
