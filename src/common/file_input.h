// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <vector>

namespace ignis {

/// All bytes of a file; none when it cannot be opened. Throws std::ios_base::failure when the disk does not give it
/// back.
[[nodiscard]] inline std::vector<std::byte> read_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::vector<char> letters{std::istreambuf_iterator<char>(in), {}};
  const std::span<const std::byte> bytes = std::as_bytes(std::span(letters));
  return {bytes.begin(), bytes.end()};
}

}  // namespace ignis
