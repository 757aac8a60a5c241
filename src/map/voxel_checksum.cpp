// SPDX-License-Identifier: Apache-2.0
#include "map/voxel_checksum.h"

#include <format>

namespace ignis {
namespace {

constexpr std::uint64_t kGoldenGamma = 0x9e3779b97f4a7c15ULL;

constexpr std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

}  // namespace

std::uint64_t voxel_checksum(std::size_t level, const CellIndex& cell, std::uint8_t intensity, bool live) {
  const auto bits = [](std::int32_t index) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(index)); };
  const std::uint64_t first = bits(cell.x) << 32 | bits(cell.y);
  const std::uint64_t second =
      bits(cell.z) << 32 | static_cast<std::uint64_t>(level) << 16 | std::uint64_t{intensity} << 8 | (live ? 1U : 0U);
  return mixed(mixed(first + kGoldenGamma) + second);
}

std::string checksum_text(std::uint64_t checksum) { return std::format("{:016x}", checksum); }

}  // namespace ignis
