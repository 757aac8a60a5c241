// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "map/map_picture.h"

/// The binary messages of the view's stream, as docs/wire_format.md lays them out: little-endian, every item on a
/// 4-byte boundary.
namespace ignis {

/// The WebSocket subprotocol that server and client agree on.
inline constexpr char kStreamProtocol[] = "ignis.lio_map.v2";
inline constexpr int kStreamVersion = 2;

inline constexpr std::size_t kStreamHeaderBytes = 76;
inline constexpr std::size_t kVoxelRecordBytes = 8;
inline constexpr std::uint32_t kUnchanged = 0xFFFFFFFF;  ///< as the count of a path or of the loop edges

/// Everything that the picture shows. Voxels whose cell does not fit 16 bits relative to the level's origin would be
/// left out; MapConfig's rules make that impossible.
[[nodiscard]] std::string encode_snapshot(const MapPicture& picture);

/// Size of encode_snapshot's result [bytes].
[[nodiscard]] std::size_t snapshot_bytes(const MapPicture& picture);

/// What turns `older` into `newer`. Nothing when a cell does not fit 16 bits relative to the newer origin: then only a
/// snapshot can tell.
[[nodiscard]] std::optional<std::string> encode_delta(const MapPicture& older, const MapPicture& newer);

/// True when a viewer that has `older` learns nothing from `newer` but where the vehicle is.
[[nodiscard]] bool shows_the_same(const MapPicture& older, const MapPicture& newer);

}  // namespace ignis
