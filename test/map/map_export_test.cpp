// SPDX-License-Identifier: Apache-2.0
#include "map/map_export.h"

#include <fstream>
#include <limits>

#include <gtest/gtest.h>
#include <pcl/PCLPointCloud2.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include "map/picture_builder.h"
#include "map/random_clouds.h"

namespace ignis {
namespace {

class MapExport : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("map_export_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::create_directories(folder_);
    std::mt19937 generator(1);
    map_.add_cloud(0, test::pose_at(3, 1, 2, 0.4));
    map_.insert(0, test::random_cloud(generator, 5'000, 40.0, 4.0));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void expect_map(const pcl::PCLPointCloud2& file) {
    std::vector<std::string> names;
    for (const auto& field : file.fields) names.push_back(field.name);
    EXPECT_EQ(names, (std::vector<std::string>{"x", "y", "z", "intensity", "level"}));
    const MapPicture shown = PictureBuilder(std::numeric_limits<double>::infinity()).build(map_);
    ASSERT_EQ(file.width * file.height, shown.counts[0] + shown.counts[1] + shown.counts[2]);
    pcl::PointCloud<pcl::PointXYZI> points;
    pcl::fromPCLPointCloud2(file, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto level = static_cast<std::size_t>(file.data[i * file.point_step + file.fields[4].offset]);
      ASSERT_LT(level, kLevels);
      const Eigen::Vector3d p = points[i].getVector3fMap().cast<double>();
      const auto found = map_.find(level, map_.locator().cell_of(level, p));
      ASSERT_TRUE(found);
      EXPECT_LT((found->p_world - p).norm(), 1e-5);
      EXPECT_FLOAT_EQ(found->intensity, points[i].intensity);
    }
  }

  ThreeLevelMap map_{MapConfig{}};
  std::filesystem::path folder_;
};

TEST_F(MapExport, PclReadsThePcdBack) {
  write_pcd(folder_ / "map.pcd", map_);
  pcl::PCLPointCloud2 cloud;
  ASSERT_EQ(pcl::io::loadPCDFile((folder_ / "map.pcd").string(), cloud), 0);
  expect_map(cloud);
}

TEST_F(MapExport, PclReadsThePlyBack) {
  write_ply(folder_ / "map.ply", map_);
  pcl::PCLPointCloud2 cloud;
  ASSERT_EQ(pcl::io::loadPLYFile((folder_ / "map.ply").string(), cloud), 0);
  expect_map(cloud);
}

TEST_F(MapExport, EqualMapsGiveEqualFiles) {
  ThreeLevelMap other(MapConfig{});
  std::mt19937 generator(1);
  auto cloud = test::random_cloud(generator, 5'000, 40.0, 4.0);
  std::ranges::reverse(cloud);
  other.add_cloud(0, test::pose_at(3, 1, 2, 0.4));
  other.insert(0, cloud);
  const auto content = [](const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  write_pcd(folder_ / "a.pcd", map_);
  write_pcd(folder_ / "b.pcd", other);
  EXPECT_EQ(content(folder_ / "a.pcd"), content(folder_ / "b.pcd"));
}

TEST_F(MapExport, AnEmptyMapGivesFilesWithoutPoints) {
  const ThreeLevelMap empty(MapConfig{});
  write_pcd(folder_ / "empty.pcd", empty);
  write_ply(folder_ / "empty.ply", empty);
  pcl::PCLPointCloud2 cloud;
  EXPECT_EQ(pcl::io::loadPCDFile((folder_ / "empty.pcd").string(), cloud), 0);
  EXPECT_EQ(cloud.width * cloud.height, 0U);
  std::ifstream ply(folder_ / "empty.ply");
  const std::string text(std::istreambuf_iterator<char>(ply), {});
  EXPECT_TRUE(text.starts_with("ply\nformat binary_little_endian 1.0\nelement vertex 0\n"));
}

TEST_F(MapExport, NamesTheFileThatCannotBeWrittenAndLeavesNothingBehind) {
  const std::filesystem::path file = folder_ / "absent" / "map.pcd";
  try {
    write_pcd(file, map_);
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(file.string()), std::string::npos);
  }
  write_ply(folder_ / "map.ply", map_);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "map.ply.tmp"));
}

}  // namespace
}  // namespace ignis
