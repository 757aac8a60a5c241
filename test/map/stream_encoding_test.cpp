// SPDX-License-Identifier: Apache-2.0
#include "map/stream_encoding.h"

#include <cstring>

#include <gtest/gtest.h>

#include "map/random_clouds.h"

namespace ignis {
namespace {

/// An independent reader of the wire format, written from docs/wire_format.md.
class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}

  template <class Value>
  Value get() {
    Value value;
    EXPECT_LE(at_ + sizeof(Value), bytes_.size());
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  Eigen::Vector3f point() {
    const float x = get<float>();
    const float y = get<float>();
    const float z = get<float>();
    return {x, y, z};
  }
  std::vector<Eigen::Vector3f> path() {
    EXPECT_EQ(at_ % 4, 0U) << "counts stand on 4-byte boundaries";
    std::vector<Eigen::Vector3f> points(get<std::uint32_t>());
    for (Eigen::Vector3f& each : points) each = point();
    return points;
  }
  [[nodiscard]] std::size_t at() const { return at_; }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

StreamFrame decode(const std::string& bytes) {
  Reader reader(bytes);
  StreamFrame frame;
  frame.T_map_body.translation = reader.point().cast<double>();
  const float w = reader.get<float>();
  const Eigen::Vector3d xyz = reader.point().cast<double>();
  frame.T_map_body.rotation = Eigen::Quaterniond(static_cast<double>(w), xyz.x(), xyz.y(), xyz.z());
  for (LevelView& level : frame.levels) {
    level.cell_m = static_cast<double>(reader.get<float>());
    level.voxels.resize(reader.get<std::uint32_t>());
    level.min_height = static_cast<double>(reader.get<float>());
    level.max_height = static_cast<double>(reader.get<float>());
  }
  EXPECT_EQ(reader.at(), kStreamHeaderBytes);
  for (LevelView& level : frame.levels) {
    level.origin.x = reader.get<std::int32_t>();
    level.origin.y = reader.get<std::int32_t>();
    level.origin.z = reader.get<std::int32_t>();
    for (ViewVoxel& voxel : level.voxels) {
      voxel.cell.x = level.origin.x + reader.get<std::int16_t>();
      voxel.cell.y = level.origin.y + reader.get<std::int16_t>();
      voxel.cell.z = level.origin.z + reader.get<std::int16_t>();
      voxel.intensity = reader.get<std::uint8_t>();
      voxel.live = (reader.get<std::uint8_t>() & 1) != 0;
    }
  }
  frame.odometry_path = reader.path();
  frame.corrected_path = reader.path();
  frame.loop_edges.resize(reader.get<std::uint32_t>());
  for (auto& [from, to] : frame.loop_edges) {
    from = reader.point();
    to = reader.point();
  }
  EXPECT_EQ(reader.at(), bytes.size()) << "bytes behind the end";
  return frame;
}

StreamFrame example_frame() {
  std::mt19937 generator(1);
  ThreeLevelMap map(MapConfig{});
  StreamFrame frame;
  frame.T_map_body = test::pose_at(-1'203.5, 2.25, 640.125, 0.75);
  map.insert(test::random_cloud(generator, 4'000, 40.0, 4.0), frame.T_map_body, 3);
  map.insert(test::random_cloud(generator, 4'000, 9.0, 4.0), frame.T_map_body);
  frame.levels = map.view(35.0);
  frame.odometry_path = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  frame.corrected_path = {{-1, -2, -3}};
  frame.loop_edges = {{{0, 1, 2}, {3, 4, 5}}, {{6, 7, 8}, {9, 10, 11}}};
  return frame;
}

TEST(StreamEncoding, HeaderIsExactly76BytesAndAnEmptyFrameIs124) {
  // 76 header + 3 origins of 12 + two path counts and one edge count of 4.
  EXPECT_EQ(kStreamHeaderBytes, 76U);
  EXPECT_EQ(encode_frame(StreamFrame{}).size(), 76U + 36U + 12U);
}

TEST(StreamEncoding, HasTheSizeThatTheDocumentStates) {
  const StreamFrame frame = example_frame();
  std::size_t voxels = 0;
  for (const LevelView& level : frame.levels) voxels += level.voxels.size();
  EXPECT_EQ(encode_frame(frame).size(), 124 + 8 * voxels + 12 * (3 + 1) + 24 * 2);
}

TEST(StreamEncoding, DecodesToTheSameFrame) {
  const StreamFrame frame = example_frame();
  const StreamFrame decoded = decode(encode_frame(frame));
  EXPECT_LT((decoded.T_map_body.translation - frame.T_map_body.translation).norm(), 1e-3);
  EXPECT_LT(decoded.T_map_body.rotation.angularDistance(frame.T_map_body.rotation), 1e-6);
  for (std::size_t i = 0; i < kLevels; ++i) {
    const LevelView& expected = frame.levels[i];
    const LevelView& actual = decoded.levels[i];
    EXPECT_GT(expected.voxels.size(), 100U);
    EXPECT_EQ(actual.cell_m, expected.cell_m);
    EXPECT_EQ(actual.origin, expected.origin);
    EXPECT_FLOAT_EQ(static_cast<float>(actual.min_height), static_cast<float>(expected.min_height));
    EXPECT_FLOAT_EQ(static_cast<float>(actual.max_height), static_cast<float>(expected.max_height));
    ASSERT_EQ(actual.voxels.size(), expected.voxels.size());
    for (std::size_t k = 0; k < expected.voxels.size(); ++k) {
      EXPECT_EQ(actual.voxels[k].cell, expected.voxels[k].cell);
      EXPECT_EQ(actual.voxels[k].intensity, expected.voxels[k].intensity);
      EXPECT_EQ(actual.voxels[k].live, expected.voxels[k].live);
    }
  }
  EXPECT_EQ(decoded.odometry_path, frame.odometry_path);
  EXPECT_EQ(decoded.corrected_path, frame.corrected_path);
  EXPECT_EQ(decoded.loop_edges, frame.loop_edges);
}

TEST(StreamEncoding, EncodingADecodedFrameGivesTheSameBytes) {
  const std::string bytes = encode_frame(example_frame());
  EXPECT_EQ(encode_frame(decode(bytes)), bytes);
}

TEST(StreamEncoding, LeavesOutCellsThatSixteenBitsCannotHoldAndCountsTheRest) {
  StreamFrame frame;
  frame.levels[1].origin = {100, 0, 0};
  frame.levels[1].voxels = {
      {{100 + 32'767, 0, 0}, 1, true}, {{100 + 32'768, 0, 0}, 2, true}, {{0, -32'768, 0}, 3, true}};
  const StreamFrame decoded = decode(encode_frame(frame));
  ASSERT_EQ(decoded.levels[1].voxels.size(), 2U);
  EXPECT_EQ(decoded.levels[1].voxels[0].cell.x, 100 + 32'767);
  EXPECT_EQ(decoded.levels[1].voxels[1].cell.y, -32'768);
}

}  // namespace
}  // namespace ignis
