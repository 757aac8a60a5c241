// SPDX-License-Identifier: Apache-2.0
#include "messages/sensor_messages.h"

#include <algorithm>
#include <bit>

#include <boost/endian/conversion.hpp>

#include "messages/field_copy.h"
#include "messages/length_check.h"

namespace ignis::messages {
namespace {

using boost::endian::load_big_s16;
using boost::endian::load_big_s32;
using boost::endian::load_big_s64;

// Offsets in an encoded scan_t behind the fingerprint; order of the fields in scan_t.lcm.
constexpr std::size_t kSequenceAt = 8;
constexpr std::size_t kPartAt = 12;
constexpr std::size_t kPartCountAt = 14;
constexpr std::size_t kDurationAt = 16;
constexpr std::size_t kMissingPacketsAt = 20;
constexpr std::size_t kPointCountAt = 24;
constexpr std::size_t kArraysAt = 28;
constexpr std::size_t kNumberBytes = 4;  // of an element of each array

const unsigned char* bytes_of(std::span<const std::byte> body) {
  return reinterpret_cast<const unsigned char*>(body.data());
}

std::size_t point_count(std::span<const std::byte> body) {
  return static_cast<std::size_t>(load_big_s32(bytes_of(body) + kPointCountAt));
}

/// The points of a part into the places from `to` on.
void read_points(std::span<const std::byte> body, ScanPoint* to) {
  const std::size_t count = point_count(body);
  const auto number = [arrays = bytes_of(body) + kArraysAt, count](std::size_t array, std::size_t i) {
    return load_big_s32(arrays + kNumberBytes * (array * count + i));
  };
  for (std::size_t i = 0; i < count; ++i) {
    to[i].position = {std::bit_cast<float>(number(0, i)), std::bit_cast<float>(number(1, i)),
                      std::bit_cast<float>(number(2, i))};
    to[i].intensity = std::bit_cast<float>(number(3, i));
    to[i].dt_us = number(4, i);
  }
}

}  // namespace

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
  const unsigned char* body = bytes_of(data.subspan(kFingerprintBytes));
  const ScanHead head{.utime = load_big_s64(body),
                      .sequence = load_big_s32(body + kSequenceAt),
                      .part = load_big_s16(body + kPartAt),
                      .part_count = load_big_s16(body + kPartCountAt)};
  if (!stamps_are_possible(head)) return std::nullopt;
  return head;
}

bool ScanPart::read(std::span<const std::byte> from) {
  const std::optional<ScanHead> head = read_scan_head(from);
  if (!head) return false;
  static_cast<ScanHead&>(*this) = *head;
  data = from;
  return true;
}

Scan EncodedScan::read_frame() const {
  const unsigned char* first = bytes_of(bodies_.front());
  return {.utime = load_big_s64(first),
          .sequence = load_big_s32(first + kSequenceAt),
          .duration_us = load_big_s32(first + kDurationAt),
          .missing_packets = load_big_s32(first + kMissingPacketsAt),
          .points = {}};
}

Scan EncodedScan::read() const {
  Scan scan = read_frame();
  std::size_t total = 0;
  for (const auto& body : bodies_) total += point_count(body);
  scan.points.resize(total);
  std::size_t filled = 0;
  for (const auto& body : bodies_) {
    read_points(body, scan.points.data() + filled);
    filled += point_count(body);
  }
  return scan;
}

std::optional<EncodedScan> EncodedScanAssembler::add(std::span<const std::byte> data,
                                                     std::shared_ptr<const void> owner) {
  const std::optional<ScanHead> head = read_scan_head(data);
  if (!head) return std::nullopt;
  auto parts =
      parts_.add({head->sequence, head->part, head->part_count, data.subspan(kFingerprintBytes), std::move(owner)});
  if (!parts) return std::nullopt;
  EncodedScan::Bodies bodies;
  std::vector<std::shared_ptr<const void>> owners;
  for (Part& part : *parts) {
    bodies.push_back(part.body);
    if (part.owner) owners.push_back(std::move(part.owner));
  }
  return EncodedScan(std::move(bodies), std::move(owners));
}

}  // namespace ignis::messages
