// SPDX-License-Identifier: Apache-2.0
#include "map/stream_encoding.h"

#include <array>
#include <bit>
#include <limits>

namespace ignis {
namespace {

constexpr std::uint8_t kLiveFlag = 1;

class Writer {
 public:
  void u8(std::uint8_t value) { bytes_.push_back(static_cast<char>(value)); }
  void i16(std::int32_t value) {
    const auto bits = static_cast<std::uint16_t>(value);
    u8(static_cast<std::uint8_t>(bits));
    u8(static_cast<std::uint8_t>(bits >> 8));
  }
  void u32(std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8) u8(static_cast<std::uint8_t>(value >> shift));
  }
  void i32(std::int32_t value) { u32(static_cast<std::uint32_t>(value)); }
  void f32(float value) { u32(std::bit_cast<std::uint32_t>(value)); }
  void f32(double value) { f32(static_cast<float>(value)); }
  void point(const Eigen::Vector3f& value) {
    for (const float coordinate : value) f32(coordinate);
  }
  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

bool fits(std::int32_t value) {
  return value >= std::numeric_limits<std::int16_t>::min() && value <= std::numeric_limits<std::int16_t>::max();
}

/// The voxels of a level that fit the record, with cells relative to the level's origin.
std::vector<ViewVoxel> relative_voxels(const LevelView& level) {
  std::vector<ViewVoxel> relative;
  relative.reserve(level.voxels.size());
  for (ViewVoxel voxel : level.voxels) {
    voxel.cell = {voxel.cell.x - level.origin.x, voxel.cell.y - level.origin.y, voxel.cell.z - level.origin.z};
    if (fits(voxel.cell.x) && fits(voxel.cell.y) && fits(voxel.cell.z)) relative.push_back(voxel);
  }
  return relative;
}

void write_pose(const Pose& pose, Writer& writer) {
  for (const double coordinate : pose.translation) writer.f32(coordinate);
  for (const double part : {pose.rotation.w(), pose.rotation.x(), pose.rotation.y(), pose.rotation.z()}) {
    writer.f32(part);
  }
}

void write_voxels(const CellIndex& origin, const std::vector<ViewVoxel>& voxels, Writer& writer) {
  for (const std::int32_t index : {origin.x, origin.y, origin.z}) writer.i32(index);
  for (const ViewVoxel& voxel : voxels) {
    for (const std::int32_t index : {voxel.cell.x, voxel.cell.y, voxel.cell.z}) writer.i16(index);
    writer.u8(voxel.intensity);
    writer.u8(voxel.live ? kLiveFlag : 0);
  }
}

void write_path(const std::vector<Eigen::Vector3f>& path, Writer& writer) {
  writer.u32(static_cast<std::uint32_t>(path.size()));
  for (const Eigen::Vector3f& point : path) writer.point(point);
}

}  // namespace

std::string encode_frame(const StreamFrame& frame) {
  Writer writer;
  std::array<std::vector<ViewVoxel>, kLevels> voxels;
  std::size_t records = 0;
  for (std::size_t i = 0; i < kLevels; ++i) {
    voxels[i] = relative_voxels(frame.levels[i]);
    records += voxels[i].size();
  }
  writer.reserve(kStreamHeaderBytes + kVoxelRecordBytes * records + 64 +
                 12 * (frame.odometry_path.size() + frame.corrected_path.size() + 2 * frame.loop_edges.size()));
  write_pose(frame.T_map_body, writer);
  for (std::size_t i = 0; i < kLevels; ++i) {
    writer.f32(frame.levels[i].cell_m);
    writer.u32(static_cast<std::uint32_t>(voxels[i].size()));
    writer.f32(frame.levels[i].min_height);
    writer.f32(frame.levels[i].max_height);
  }
  for (std::size_t i = 0; i < kLevels; ++i) write_voxels(frame.levels[i].origin, voxels[i], writer);
  write_path(frame.odometry_path, writer);
  write_path(frame.corrected_path, writer);
  writer.u32(static_cast<std::uint32_t>(frame.loop_edges.size()));
  for (const auto& [from, to] : frame.loop_edges) {
    writer.point(from);
    writer.point(to);
  }
  return writer.take();
}

}  // namespace ignis
