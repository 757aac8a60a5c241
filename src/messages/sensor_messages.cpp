// SPDX-License-Identifier: Apache-2.0
#include "messages/sensor_messages.h"

#include <algorithm>

#include <boost/endian/conversion.hpp>

#include "messages/field_copy.h"
#include "messages/length_check.h"

namespace ignis::messages {

imu_t to_message(const ImuSample& sample, float temperature) {
  imu_t message;
  message.utime = sample.utime;
  message.sequence = sample.sequence;
  store(sample.gyro, message.gyro);
  store(sample.accel, message.accel);
  message.temperature = temperature;
  message.saturated = sample.saturated ? 1 : 0;
  return message;
}

ImuSample from_message(const imu_t& message) {
  return {.utime = message.utime,
          .sequence = message.sequence,
          .gyro = load(message.gyro),
          .accel = load(message.accel),
          .saturated = message.saturated != 0};
}

std::vector<scan_t> to_messages(const Scan& scan) {
  const std::int64_t total = std::ssize(scan.points);
  const std::int64_t part_count = std::max<std::int64_t>(1, (total + kMaxPointsPerPart - 1) / kMaxPointsPerPart);
  std::vector<scan_t> parts;
  parts.reserve(static_cast<std::size_t>(part_count));
  for (std::int64_t part = 0; part < part_count; ++part) {
    scan_t& message = parts.emplace_back();
    message.utime = scan.utime;
    message.sequence = scan.sequence;
    message.part = static_cast<std::int16_t>(part);
    message.part_count = static_cast<std::int16_t>(part_count);
    message.duration_us = scan.duration_us;
    message.missing_packets = scan.missing_packets;
    const std::int64_t begin = part * kMaxPointsPerPart;
    const std::int64_t end = std::min(total, begin + kMaxPointsPerPart);
    message.num_points = static_cast<std::int32_t>(end - begin);
    for (std::int64_t i = begin; i < end; ++i) {
      const ScanPoint& point = scan.points[static_cast<std::size_t>(i)];
      message.x.push_back(point.position.x());
      message.y.push_back(point.position.y());
      message.z.push_back(point.position.z());
      message.intensity.push_back(point.intensity);
      message.dt_us.push_back(point.dt_us);
    }
  }
  return parts;
}

std::optional<ScanHead> read_scan_head(std::span<const std::byte> data) {
  if (!is_whole<scan_t>(data)) return std::nullopt;
  // Order of the fields in scan_t.lcm.
  const auto* body = reinterpret_cast<const unsigned char*>(data.data()) + kFingerprintBytes;
  const ScanHead head{.utime = boost::endian::load_big_s64(body),
                      .sequence = boost::endian::load_big_s32(body + 8),
                      .part = boost::endian::load_big_s16(body + 12),
                      .part_count = boost::endian::load_big_s16(body + 14)};
  if (!stamps_are_possible(head)) return std::nullopt;
  return head;
}

std::optional<Scan> ScanAssembler::add(const scan_t& part) {
  const std::optional<std::vector<scan_t>> parts = parts_.add(part);
  if (!parts) return std::nullopt;
  const scan_t& first = parts->front();
  Scan scan{.utime = first.utime,
            .sequence = first.sequence,
            .duration_us = first.duration_us,
            .missing_packets = first.missing_packets,
            .points = {}};
  for (const scan_t& each : *parts) {
    for (std::size_t i = 0; i < each.x.size(); ++i) {
      scan.points.push_back(
          {.position = {each.x[i], each.y[i], each.z[i]}, .intensity = each.intensity[i], .dt_us = each.dt_us[i]});
    }
  }
  return scan;
}

}  // namespace ignis::messages
