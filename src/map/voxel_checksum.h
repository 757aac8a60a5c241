// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "map/cell_index.h"

namespace ignis {

/// What one voxel adds to the checksum of a view. The checksum is the sum over all voxels modulo 2^64: it does not
/// depend on their order, and each side keeps it up to date with an addition or a subtraction per changed voxel.
/// The mixing is the finaliser of splitmix64 (Steele, Lea, Flood 2014); docs/wire_format.md has it with a test vector.
[[nodiscard]] std::uint64_t voxel_checksum(std::size_t level, const CellIndex& cell, std::uint8_t intensity, bool live);

/// Sixteen hexadecimal digits, as the stream and the status carry a checksum.
[[nodiscard]] std::string checksum_text(std::uint64_t checksum);

}  // namespace ignis
