// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/mavlink_frame.h"

/// Streams and packets that several driver tests share.
namespace ignis::l1::samples {

using Bytes = std::vector<std::byte>;

inline std::string test_file(const std::string& name) { return std::string(IGNIS_TEST_DATA) + "/l1/" + name; }

inline Bytes read_bytes(const std::string& name) {
  std::ifstream file(test_file(name), std::ios::binary);
  if (!file) throw std::runtime_error("missing " + test_file(name));
  const std::vector<char> text((std::istreambuf_iterator<char>(file)), {});
  const auto* first = reinterpret_cast<const std::byte*>(text.data());
  return {first, first + text.size()};
}

/// Rows of a CSV file without its header, as text.
inline std::vector<std::vector<std::string>> read_rows(const std::string& name) {
  std::ifstream file(test_file(name));
  if (!file) throw std::runtime_error("missing " + test_file(name));
  std::vector<std::vector<std::string>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::stringstream cells(line);
    std::vector<std::string>& row = rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
  }
  return rows;
}

inline Bytes from_hex(const std::string& text) {
  std::istringstream words(text);
  Bytes bytes;
  for (std::string word; words >> word;) bytes.push_back(static_cast<std::byte>(std::stoul(word, nullptr, 16)));
  return bytes;
}

inline void append(Bytes& stream, const Bytes& bytes) { stream.insert(stream.end(), bytes.begin(), bytes.end()); }

/// A plausible scan: 2 m all round, flat calibration.
inline Auxiliary auxiliary(std::uint16_t id) {
  Auxiliary message;
  message.packet_id = id;
  message.yaw_start_deg = 124.5F;
  message.yaw_step_deg = 10.1F;
  message.vertical_start_deg = 0.1875F;
  message.vertical_step_deg = 1.5F;
  message.b_axis_mm = 6.6F;
  message.ksi_rad = 0.03F;
  message.reflectivity.fill(100);
  return message;
}

inline Distance distance(std::uint16_t id) {
  Distance message;
  message.packet_id = id;
  message.ranges_mm.fill(2000);
  return message;
}

inline ImuAttitude imu(std::uint16_t id) {
  return {.quaternion = {1.0F, 0.0F, 0.0F, 0.0F},
          .gyro = {0.01F, -0.02F, 0.03F},
          .accel = {0.1F, -0.2F, 9.81F},
          .packet_id = id};
}

template <class Message>
Bytes frame(std::uint32_t id, const Message& message, int sequence = 0) {
  return encode_frame(id, encode(message), static_cast<std::uint8_t>(sequence));
}

}  // namespace ignis::l1::samples
