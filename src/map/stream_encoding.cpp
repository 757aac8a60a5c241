// SPDX-License-Identifier: Apache-2.0
#include "map/stream_encoding.h"

#include <bit>
#include <cstring>
#include <limits>
#include <span>

namespace ignis {
namespace {

static_assert(std::endian::native == std::endian::little, "the stream is little-endian, and is written as it is held");

constexpr std::uint8_t kLiveFlag = 1;
constexpr std::uint8_t kGoneFlag = 2;

struct Record {
  std::int16_t x;
  std::int16_t y;
  std::int16_t z;
  std::uint8_t intensity;
  std::uint8_t flags;
};
static_assert(sizeof(Record) == kVoxelRecordBytes);

class Writer {
 public:
  template <class Value>
  void number(Value value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void f32(double value) { number(static_cast<float>(value)); }
  void point(const Eigen::Vector3f& value) {
    for (const float coordinate : value) number(coordinate);
  }
  void records(std::span<const Record> records) {
    bytes_.append(reinterpret_cast<const char*>(records.data()), records.size_bytes());
  }
  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

bool fits(std::int64_t value) {
  return value >= std::numeric_limits<std::int16_t>::min() && value <= std::numeric_limits<std::int16_t>::max();
}

/// The record of a voxel relative to the origin, or nothing when it does not fit.
std::optional<Record> record_of(const CellIndex& cell, const CellIndex& origin, std::uint8_t intensity,
                                std::uint8_t flags) {
  const std::int64_t x = std::int64_t{cell.x} - origin.x;
  const std::int64_t y = std::int64_t{cell.y} - origin.y;
  const std::int64_t z = std::int64_t{cell.z} - origin.z;
  if (!fits(x) || !fits(y) || !fits(z)) return std::nullopt;
  return Record{static_cast<std::int16_t>(x), static_cast<std::int16_t>(y), static_cast<std::int16_t>(z), intensity,
                flags};
}

using Records = std::array<std::vector<Record>, kLevels>;

Records all_records(const MapPicture& picture) {
  Records records;
  for (std::size_t i = 0; i < kLevels; ++i) {
    records[i].reserve(picture.counts[i]);
    for (const SharedTilePicture& tile : picture.tiles) {
      for (const std::uint64_t voxel : tile->voxels[i]) {
        const CellIndex cell = picture.grid.world_cell(i, tile->tile, TileVoxel::cell(voxel));
        const std::uint8_t flags = TileVoxel::live(voxel) ? kLiveFlag : 0;
        if (const auto record = record_of(cell, picture.origins[i], TileVoxel::intensity(voxel), flags)) {
          records[i].push_back(*record);
        }
      }
    }
  }
  return records;
}

std::optional<Records> changed_records(const MapPicture& older, const MapPicture& newer) {
  Records records;
  const auto changes = difference(older, newer);
  for (std::size_t i = 0; i < kLevels; ++i) {
    records[i].reserve(changes[i].size());
    for (const VoxelChange& change : changes[i]) {
      const auto flags = static_cast<std::uint8_t>((change.live ? kLiveFlag : 0) | (change.gone ? kGoneFlag : 0));
      const auto record = record_of(change.cell, newer.origins[i], change.intensity, flags);
      if (!record) return std::nullopt;
      records[i].push_back(*record);
    }
  }
  return records;
}

void write_header(const MapPicture& picture, const Records& records, Writer& writer) {
  const Eigen::Quaterniond& q = picture.T_map_body.rotation;
  for (const double coordinate : picture.T_map_body.translation) writer.f32(coordinate);
  for (const double part : {q.w(), q.x(), q.y(), q.z()}) writer.f32(part);
  for (std::size_t i = 0; i < kLevels; ++i) {
    const bool none = picture.counts[i] == 0;
    writer.f32(picture.grid.cell_m[i]);
    writer.number(static_cast<std::uint32_t>(records[i].size()));
    writer.f32(none ? 0.0 : picture.heights[i].min);
    writer.f32(none ? 0.0 : picture.heights[i].max);
  }
}

void write_voxels(const MapPicture& picture, const Records& records, Writer& writer) {
  for (std::size_t i = 0; i < kLevels; ++i) {
    const CellIndex& origin = picture.origins[i];
    for (const std::int32_t index : {origin.x, origin.y, origin.z}) writer.number(index);
    writer.records(records[i]);
  }
}

void write_path(const SharedPath& path, Writer& writer) {
  writer.number(path ? static_cast<std::uint32_t>(path->size()) : 0U);
  if (!path) return;
  for (const Eigen::Vector3f& point : *path) writer.point(point);
}

void write_edges(const SharedLoopEdges& edges, Writer& writer) {
  writer.number(edges ? static_cast<std::uint32_t>(edges->size()) : 0U);
  if (!edges) return;
  for (const LoopEdge& edge : *edges) {
    writer.point(edge.from);
    writer.point(edge.to);
    writer.number(edge.from_id);
    writer.number(edge.to_id);
  }
}

/// Equal, and for what is the same object without looking inside.
template <class Shared>
bool same(const Shared& a, const Shared& b) {
  if (a == b) return true;
  return a && b && *a == *b;
}

template <class Shared>
std::size_t size_of(const Shared& items, std::size_t item_bytes) {
  return 4 + (items ? item_bytes * items->size() : 0);
}

constexpr std::size_t kPathPointBytes = 12;
constexpr std::size_t kLoopEdgeBytes = 32;

std::size_t size_of_rest(const MapPicture& picture) {
  return size_of(picture.odometry_path, kPathPointBytes) + size_of(picture.corrected_path, kPathPointBytes) +
         size_of(picture.loop_edges, kLoopEdgeBytes);
}

}  // namespace

std::size_t snapshot_bytes(const MapPicture& picture) {
  const std::size_t voxels = std::size_t{picture.counts[0]} + picture.counts[1] + picture.counts[2];
  return kStreamHeaderBytes + 12 * kLevels + kVoxelRecordBytes * voxels + size_of_rest(picture);
}

std::string encode_snapshot(const MapPicture& picture) {
  Writer writer;
  writer.reserve(snapshot_bytes(picture));
  const Records records = all_records(picture);
  write_header(picture, records, writer);
  write_voxels(picture, records, writer);
  write_path(picture.odometry_path, writer);
  write_path(picture.corrected_path, writer);
  write_edges(picture.loop_edges, writer);
  return writer.take();
}

std::optional<std::string> encode_delta(const MapPicture& older, const MapPicture& newer) {
  const std::optional<Records> records = changed_records(older, newer);
  if (!records) return std::nullopt;
  Writer writer;
  writer.reserve(kStreamHeaderBytes + 12 * kLevels + size_of_rest(newer) +
                 kVoxelRecordBytes * ((*records)[0].size() + (*records)[1].size() + (*records)[2].size()));
  write_header(newer, *records, writer);
  write_voxels(newer, *records, writer);
  const auto write_path_if_changed = [&](const SharedPath& before, const SharedPath& after) {
    same(before, after) ? writer.number(kUnchanged) : write_path(after, writer);
  };
  write_path_if_changed(older.odometry_path, newer.odometry_path);
  write_path_if_changed(older.corrected_path, newer.corrected_path);
  same(older.loop_edges, newer.loop_edges) ? writer.number(kUnchanged) : write_edges(newer.loop_edges, writer);
  return writer.take();
}

bool shows_the_same(const MapPicture& older, const MapPicture& newer) {
  return older.revision == newer.revision && older.tiles == newer.tiles &&
         same(older.odometry_path, newer.odometry_path) && same(older.corrected_path, newer.corrected_path) &&
         same(older.loop_edges, newer.loop_edges);
}

}  // namespace ignis
