// SPDX-License-Identifier: Apache-2.0
#include "map/stream_encoding.h"

#include <cstring>

#include <gtest/gtest.h>

#include "map/random_clouds.h"
#include "map/random_pictures.h"
#include "map/voxel_checksum.h"

namespace ignis {
namespace {

using test::picture_of;
using test::random_view;
using test::ViewTable;

/// An independent reader of the wire format, written from docs/wire_format.md: a client that holds voxels.
class Client {
 public:
  void apply(const std::string& bytes, bool is_snapshot) {
    bytes_ = &bytes;
    at_ = 0;
    if (is_snapshot) view = {};
    for (float& value : pose) value = get<float>();
    std::array<std::uint32_t, kLevels> counts{};
    for (std::size_t i = 0; i < kLevels; ++i) {
      cell_m[i] = get<float>();
      counts[i] = get<std::uint32_t>();
      heights[i] = {static_cast<double>(get<float>()), static_cast<double>(get<float>())};
    }
    EXPECT_EQ(at_, kStreamHeaderBytes);
    for (std::size_t i = 0; i < kLevels; ++i) apply_level(i, counts[i]);
    path(odometry);
    path(corrected);
    edges();
    EXPECT_EQ(at_, bytes.size()) << "bytes behind the end";
  }

  std::array<float, 7> pose{};
  std::array<float, kLevels> cell_m{};
  std::array<std::pair<double, double>, kLevels> heights{};
  ViewTable view;
  std::vector<Eigen::Vector3f> odometry;
  std::vector<Eigen::Vector3f> corrected;
  std::vector<LoopEdge> loop_edges;
  int unchanged = 0;

 private:
  template <class Value>
  Value get() {
    Value value;
    EXPECT_LE(at_ + sizeof(Value), bytes_->size());
    std::memcpy(&value, bytes_->data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  Eigen::Vector3f point() {
    const float x = get<float>();
    const float y = get<float>();
    const float z = get<float>();
    return {x, y, z};
  }
  void apply_level(std::size_t level, std::uint32_t count) {
    const auto x = get<std::int32_t>();
    const auto y = get<std::int32_t>();
    const auto z = get<std::int32_t>();
    for (std::uint32_t i = 0; i < count; ++i) {
      CellIndex cell{x, y, z};
      cell.x += get<std::int16_t>();
      cell.y += get<std::int16_t>();
      cell.z += get<std::int16_t>();
      const auto intensity = get<std::uint8_t>();
      const auto flags = get<std::uint8_t>();
      if ((flags & 2) != 0) {
        EXPECT_EQ(view.voxels.erase({level, cell}), 1U) << "what is gone was there";
      } else {
        view.voxels[{level, cell}] = {intensity, (flags & 1) != 0};
      }
    }
  }
  std::uint32_t count() {
    EXPECT_EQ(at_ % 4, 0U) << "counts stand on 4-byte boundaries";
    return get<std::uint32_t>();
  }
  void path(std::vector<Eigen::Vector3f>& points) {
    const std::uint32_t size = count();
    if (size == kUnchanged) {
      ++unchanged;
      return;
    }
    points.resize(size);
    for (Eigen::Vector3f& each : points) each = point();
  }
  void edges() {
    const std::uint32_t size = count();
    if (size == kUnchanged) {
      ++unchanged;
      return;
    }
    loop_edges.resize(size);
    for (LoopEdge& edge : loop_edges) {
      edge.from = point();
      edge.to = point();
      edge.from_id = get<std::int32_t>();
      edge.to_id = get<std::int32_t>();
    }
  }

  const std::string* bytes_ = nullptr;
  std::size_t at_ = 0;
};

std::uint64_t checksum_of(const ViewTable& view) {
  std::uint64_t sum = 0;
  for (const auto& [where, what] : view.voxels)
    sum += voxel_checksum(where.first, where.second, what.first, what.second);
  return sum;
}

template <class Item>
std::shared_ptr<const std::vector<Item>> shared(std::vector<Item> items) {
  return std::make_shared<const std::vector<Item>>(std::move(items));
}

MapPicture example_picture(const ViewTable& view) {
  MapPicture picture = picture_of(view, {-75, 0, 40});
  picture.T_map_body = test::pose_at(-1'203.5, 2.25, 640.125, 0.75);
  picture.odometry_path = shared<Eigen::Vector3f>({{1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
  picture.corrected_path = shared<Eigen::Vector3f>({{-1, -2, -3}});
  picture.loop_edges = shared<LoopEdge>({{{0, 1, 2}, {3, 4, 5}, 12, 3}, {{6, 7, 8}, {9, 10, 11}, 40, 4}});
  return picture;
}

TEST(VoxelChecksum, HasTheValuesOfTheDocument) {
  EXPECT_EQ(checksum_text(voxel_checksum(0, {0, 0, 0}, 0, false)), "48218226ff3cd4bf");
  EXPECT_EQ(checksum_text(voxel_checksum(0, {12, -3, -40}, 200, true)), "dce79a6796ba3470");
  EXPECT_EQ(checksum_text(voxel_checksum(1, {-7, 5, 1'000'000}, 17, false)), "add9d91299c6c452");
  EXPECT_EQ(checksum_text(voxel_checksum(2, {-1, -1, -1}, 255, true)), "65d5eea127f3fe0d");
}

TEST(StreamEncoding, HeaderIsExactly76BytesAndAnEmptySnapshotIs124) {
  // 76 header + 3 origins of 12 + two path counts and one edge count of 4.
  EXPECT_EQ(kStreamHeaderBytes, 76U);
  EXPECT_EQ(encode_snapshot(MapPicture{}).size(), 76U + 36U + 12U);
}

TEST(StreamEncoding, ASnapshotHasTheSizeThatTheDocumentStates) {
  std::mt19937 generator(1);
  const ViewTable view = random_view(generator, 3'000, {-75, 0, 40});
  const MapPicture picture = example_picture(view);
  EXPECT_EQ(encode_snapshot(picture).size(), 124 + 8 * view.voxels.size() + 12 * (3 + 1) + 32 * 2);
  EXPECT_EQ(snapshot_bytes(picture), encode_snapshot(picture).size());
}

TEST(StreamEncoding, ASnapshotDecodesToWhatThePictureShows) {
  std::mt19937 generator(2);
  const ViewTable view = random_view(generator, 3'000, {-75, 0, 40});
  const MapPicture picture = example_picture(view);
  Client client;
  client.apply(encode_snapshot(picture), true);
  EXPECT_EQ(client.view, view);
  EXPECT_EQ(checksum_of(client.view), picture.checksum);
  EXPECT_NEAR(static_cast<double>(client.pose[0]), -1'203.5, 1e-3);
  EXPECT_NEAR(static_cast<double>(client.pose[3]), picture.T_map_body.rotation.w(), 1e-6);
  for (std::size_t i = 0; i < kLevels; ++i) {
    EXPECT_EQ(static_cast<double>(client.cell_m[i]), picture.grid.cell_m[i]);
    EXPECT_EQ(client.heights[i], std::pair(picture.heights[i].min, picture.heights[i].max));
  }
  EXPECT_EQ(client.odometry, *picture.odometry_path);
  EXPECT_EQ(client.corrected, *picture.corrected_path);
  EXPECT_EQ(client.loop_edges, *picture.loop_edges);
}

TEST(StreamEncoding, AnyChainOfDeltasLeadsToTheNewestPicture) {
  std::mt19937 generator(3);
  for (int round = 0; round < 20; ++round) {
    ViewTable view = random_view(generator, 400, {5, -1, 9});
    MapPicture held = picture_of(view, {5, -1, 9});
    Client client;
    client.apply(encode_snapshot(held), true);
    for (int step = 0; step < 10; ++step) {
      // Some voxels go, some change, some come; at times everything is new.
      if (step == 5) view = {};
      std::erase_if(view.voxels, [&](const auto&) { return generator() % 7 == 0; });
      for (auto& [where, what] : view.voxels) {
        if (generator() % 11 == 0) what.second = !what.second;
      }
      view.voxels.merge(random_view(generator, 60, {5, 0, 9}).voxels);
      const MapPicture next = picture_of(view, {5, step % 2, 9}, &held);
      const auto delta = encode_delta(held, next);
      ASSERT_TRUE(delta);
      client.apply(*delta, false);
      ASSERT_EQ(client.view, view);
      ASSERT_EQ(checksum_of(client.view), next.checksum);
      held = next;
    }
  }
}

TEST(StreamEncoding, ADeltaCarriesOnlyWhatChanged) {
  std::mt19937 generator(4);
  ViewTable view = random_view(generator, 2'000, {0, 0, 0});
  MapPicture before = picture_of(view, {0, 0, 0});
  before.odometry_path = shared<Eigen::Vector3f>({{1, 2, 3}});
  auto& changed = view.voxels.begin()->second;
  changed.first = static_cast<std::uint8_t>(changed.first + 1);
  MapPicture after = picture_of(view, {0, 0, 0}, &before);
  after.odometry_path = shared<Eigen::Vector3f>({{1, 2, 3}});
  const auto delta = encode_delta(before, after);
  ASSERT_TRUE(delta);
  EXPECT_EQ(delta->size(), 124U + 8U);
  Client client;
  client.apply(encode_snapshot(before), true);
  client.apply(*delta, false);
  EXPECT_EQ(client.unchanged, 3);
  EXPECT_EQ(client.view, view);
  EXPECT_EQ(client.odometry.size(), 1U);
}

TEST(StreamEncoding, ADeltaThatSixteenBitsCannotHoldIsNone) {
  std::mt19937 generator(5);
  const MapPicture here = picture_of(random_view(generator, 10, {0, 0, 0}), {0, 0, 0});
  const MapPicture far = picture_of(random_view(generator, 10, {1'100, 0, 0}), {1'100, 0, 0});
  EXPECT_FALSE(encode_delta(here, far)) << "the voxels that are gone lie 35,200 local cells away";
  EXPECT_EQ(encode_snapshot(far).size(), snapshot_bytes(far));
}

TEST(StreamEncoding, KnowsWhenAViewerWouldLearnNothing) {
  std::mt19937 generator(6);
  const ViewTable view = random_view(generator, 100, {0, 0, 0});
  const MapPicture picture = example_picture(view);
  MapPicture moved = picture;
  moved.T_map_body.translation.x() += 1.0;
  EXPECT_TRUE(shows_the_same(picture, moved));
  MapPicture revised = picture;
  revised.revision = 8;
  EXPECT_FALSE(shows_the_same(picture, revised));
  MapPicture further = picture;
  further.corrected_path = shared<Eigen::Vector3f>({{-1, -2, -3}, {0, 0, 0}});
  EXPECT_FALSE(shows_the_same(picture, further));
  ViewTable less = view;
  less.voxels.erase(less.voxels.begin());
  EXPECT_FALSE(shows_the_same(picture, example_picture(less)));
}

}  // namespace
}  // namespace ignis
