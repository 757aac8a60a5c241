// SPDX-License-Identifier: Apache-2.0
#include "map_builder/loop_clouds.h"

#include <bit>

#include <nlohmann/json.hpp>

namespace ignis {
namespace {

static_assert(std::endian::native == std::endian::little, "the stream is little-endian, and is written as it is held");

std::size_t stride_of(std::span<const Eigen::Vector3f> points) {
  return (points.size() + kMaxLoopCloudPoints - 1) / kMaxLoopCloudPoints;
}

std::uint32_t count_of(std::span<const Eigen::Vector3f> points) {
  return points.empty() ? 0 : static_cast<std::uint32_t>((points.size() - 1) / stride_of(points) + 1);
}

void append(std::span<const Eigen::Vector3f> points, std::string& bytes) {
  for (std::size_t i = 0; i < points.size(); i += stride_of(points)) {
    bytes.append(reinterpret_cast<const char*>(points[i].data()), 3 * sizeof(float));
  }
}

}  // namespace

LoopClouds encode_loop_clouds(const LoopCloudsRequest& loop, std::span<const Eigen::Vector3f> from,
                              std::span<const Eigen::Vector3f> to) {
  const std::uint32_t counts[] = {count_of(from), count_of(to)};
  LoopClouds clouds;
  clouds.text = nlohmann::ordered_json{
      {"type", "loop_clouds"},
      {"from", loop.from_id},
      {"to", loop.to_id},
      {"from_points", counts[0]},
      {"to_points",
       counts[1]}}.dump();
  clouds.bytes.append(reinterpret_cast<const char*>(counts), sizeof counts);
  append(from, clouds.bytes);
  append(to, clouds.bytes);
  return clouds;
}

}  // namespace ignis
