// SPDX-License-Identifier: Apache-2.0
//
// What a checkpoint says of the local map, read back.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/byte_codec.h"
#include "frontend/local_map/local_map.h"

namespace ignis {
namespace {

/// The checksum of a checkpoint tells damage, not who wrote it. Found by fuzz_checkpoint.
TEST(LocalMap, BytesOfABlockThatNoVoxelHasARoomForAreImpossible) {
  LocalMap map(FrontendConfig{});
  map.insert(std::vector<Eigen::Vector3f>{{1.0F, 2.0F, 3.0F}}, Pose{}, true);
  std::vector<std::byte> bytes = to_bytes(map);
  constexpr std::size_t kFace = sizeof(std::uint32_t) + 3 * sizeof(std::int32_t);  // behind the count and the place
  for (const int face : {0, 1, 2, 255}) {
    bytes[kFace] = static_cast<std::byte>(face);
    LocalMap read(FrontendConfig{});
    ByteReader reader(bytes);
    transfer(reader, read);
    EXPECT_EQ(reader.failed(), face > 1) << face;
  }
}

}  // namespace
}  // namespace ignis
