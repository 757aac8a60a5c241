// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

/// Payloads of the Unitree L1's MAVLink 2 dialect, as plain structs, with their byte layout (little endian). encode()
/// gives the full payload; trimming trailing zeros is the frame's business (mavlink_frame.h). decode_*() take a full or
/// trimmed payload and pad it with zeros. Units are those of the wire; conversion to SI happens in scan_geometry.h.
namespace ignis::l1 {

inline constexpr std::size_t kPointsPerPacket = 120;
inline constexpr double kScanPeriodUs = 1e6 / 180.0;     ///< [us] one turn of the mirror
inline constexpr double kPointPeriodUs = 1e6 / 43200.0;  ///< [us] between two points of a packet
inline constexpr double kImuPeriodUs = 4000.0;           ///< [us]
inline constexpr double kByteTimeUs = 5.0;               ///< [us] one byte at 2,000,000 baud 8N1

enum MessageId : std::uint32_t {
  kRequestDataId = 11,
  kCommandId = 12,
  kVersionId = 13,
  kWorkingModeId = 14,
  kLedId = 15,
  kDistanceId = 16,
  kAuxiliaryId = 17,
  kTimeSyncId = 18,
  kImuId = 19,
};

/// What the frame layer must know of a message id.
struct MessageInfo {
  std::uint32_t id;
  std::uint8_t length;     ///< [bytes] of the full payload
  std::uint8_t crc_extra;  ///< MAVLink's seed of the message definition
};

/// The dialect's entry for an id, or nothing when the id is not part of it.
[[nodiscard]] std::optional<MessageInfo> message_info(std::uint32_t id);

/// Ranges of one scan (120 points). Follows the Auxiliary with the same packet_id.
struct Distance {
  std::uint16_t packet_id = 0;
  std::uint16_t packet_cnt = 1;
  std::uint16_t payload_size = 240;                         ///< [bytes] of point data
  std::array<std::uint16_t, kPointsPerPacket> ranges_mm{};  ///< [mm] slant range; 0 = no return
};

/// Angles, calibration, reflectivities and housekeeping of one scan.
struct Auxiliary {
  std::uint32_t sync_delay_us = 0;           ///< [us] round trip to the host
  std::uint32_t time_s = 0;                  ///< [s] sensor run time
  std::uint32_t time_us = 0;                 ///< [us] its fraction
  std::uint32_t sys_rotation_period_us = 0;  ///< [us]
  std::uint32_t com_rotation_period_us = 0;  ///< [us]
  float yaw_start_deg = 0;                   ///< [deg] of point 0
  float yaw_step_deg = 0;                    ///< [deg] over the whole scan of 120 points
  float vertical_start_deg = 0;              ///< [deg] mirror angle of point 0
  float vertical_step_deg = 0;               ///< [deg] per point
  float apd_temperature = 0;                 ///< [deg C]
  float dirty_index = 0;                     ///< [%] of points lost to dirt
  float imu_temperature = 0;                 ///< [deg C]
  float up_optical_q = 0;
  float down_optical_q = 0;
  float apd_voltage = 0;                    ///< [V]
  std::array<float, 3> imu_angle_offset{};  ///< unit unknown, unused
  float b_axis_mm = 0;                      ///< [mm] beam origin off the axis
  float theta_rad = 0;                      ///< [rad] calibration
  float ksi_rad = 0;                        ///< [rad] calibration
  std::uint16_t packet_id = 0;
  std::uint16_t payload_size = 120;                           ///< [bytes] of reflectivity data
  std::uint8_t work_status = 0;                               ///< bit field, see work_status_text()
  std::array<std::uint8_t, kPointsPerPacket> reflectivity{};  ///< 0..255
};

/// Attitude, rate and specific force in sensor axes. The wire carries no time for it.
struct ImuAttitude {
  std::array<float, 4> quaternion{};  ///< w x y z, norm about 0.9983
  std::array<float, 3> gyro{};        ///< [rad/s]
  std::array<float, 3> accel{};       ///< [m/s^2]
  std::uint16_t packet_id = 0;
};

/// Texts are NUL padded on the wire, such as "1.0.1+230601".
struct Version {
  std::string sys_soft;  ///< at most 13 characters
  std::string com_soft;  ///< at most 13 characters
  std::string sys_hard;  ///< at most 6 characters
  std::string com_hard;  ///< at most 6 characters
};

struct TimeSync {
  static constexpr std::uint8_t kRequest = 1;
  static constexpr std::uint8_t kResponse = 2;
  std::uint32_t count = 0;
  std::uint8_t type = kRequest;
};

/// Light ring on the rotor. Modes: 1 shows the table, 2..8 are built-in patterns that ignore it.
struct LedRing {
  static constexpr std::uint8_t kTableMode = 1;
  static constexpr std::uint8_t kLastMode = 8;
  std::uint32_t rotation_period = 0;
  std::uint32_t zero_offset_ms = 0;
  std::uint16_t packet_id = 0;
  std::uint8_t mode = kTableMode;
  std::array<std::uint8_t, 45> table{};  ///< 360 bits, one per degree
};

/// Values of the one-byte host messages RequestData (11) and WorkingMode (14).
enum class DataRequest : std::uint8_t { kClockSync = 1, kVersion = 2 };
enum class WorkingMode : std::uint8_t { kNormal = 1, kStandby = 2, kRaw = 3 };

using Payload = std::vector<std::byte>;

[[nodiscard]] Payload encode(const Distance& message);
[[nodiscard]] Payload encode(const Auxiliary& message);
[[nodiscard]] Payload encode(const ImuAttitude& message);
[[nodiscard]] Payload encode(const Version& message);
[[nodiscard]] Payload encode(const TimeSync& message);
[[nodiscard]] Payload encode(const LedRing& message);
[[nodiscard]] Payload encode(DataRequest request);
[[nodiscard]] Payload encode(WorkingMode mode);

[[nodiscard]] Distance decode_distance(std::span<const std::byte> payload);
[[nodiscard]] Auxiliary decode_auxiliary(std::span<const std::byte> payload);
[[nodiscard]] ImuAttitude decode_imu(std::span<const std::byte> payload);
[[nodiscard]] Version decode_version(std::span<const std::byte> payload);
[[nodiscard]] TimeSync decode_time_sync(std::span<const std::byte> payload);
[[nodiscard]] LedRing decode_led_ring(std::span<const std::byte> payload);
/// The value of a one-byte host message (RequestData, WorkingMode); 0 when the payload is empty.
[[nodiscard]] std::uint8_t decode_byte(std::span<const std::byte> payload);

/// Bits of Auxiliary::work_status that the driver acts on.
inline constexpr std::uint8_t kLedPatternBit = 0x08;

/// The set bits of Auxiliary::work_status in words, separated by commas; empty when none is set.
[[nodiscard]] std::string work_status_text(std::uint8_t status);

}  // namespace ignis::l1
