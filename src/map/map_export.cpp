// SPDX-License-Identifier: Apache-2.0
#include "map/map_export.h"

#include <cstring>
#include <format>
#include <limits>
#include <stdexcept>

#include <pcl/PCLPointCloud2.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include "common/file_output.h"
#include "map/picture_builder.h"

namespace ignis {
namespace {

constexpr std::uint32_t kPointStep = 4 * sizeof(float) + 1;

pcl::PCLPointField field(const char* name, std::uint32_t offset, std::uint8_t type) {
  pcl::PCLPointField field;
  field.name = name;
  field.offset = offset;
  field.datatype = type;
  field.count = 1;
  return field;
}

void append(const MapPoint& point, std::uint8_t level, std::vector<std::uint8_t>& data) {
  const Eigen::Vector3f p = point.p_world.cast<float>();
  const float values[] = {p.x(), p.y(), p.z(), point.intensity};
  const std::size_t at = data.size();
  data.resize(at + kPointStep);
  std::memcpy(&data[at], values, sizeof values);
  data[at + sizeof values] = level;
}

pcl::PCLPointCloud2 to_cloud(const ThreeLevelMap& map) {
  pcl::PCLPointCloud2 cloud;
  cloud.fields = {field("x", 0, pcl::PCLPointField::FLOAT32), field("y", 4, pcl::PCLPointField::FLOAT32),
                  field("z", 8, pcl::PCLPointField::FLOAT32), field("intensity", 12, pcl::PCLPointField::FLOAT32),
                  field("level", 16, pcl::PCLPointField::UINT8)};
  const MapPicture everything = PictureBuilder(std::numeric_limits<double>::infinity()).build(map);
  for (std::size_t i = 0; i < kLevels; ++i) {
    for (const SharedTilePicture& tile : everything.tiles) {
      for (const std::uint64_t voxel : tile->voxels[i]) {
        const CellIndex cell = map.grid().world_cell(i, tile->tile, TileVoxel::cell(voxel));
        append(*map.find(i, cell), static_cast<std::uint8_t>(i), cloud.data);
      }
    }
  }
  cloud.point_step = kPointStep;
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(cloud.data.size() / kPointStep);
  cloud.row_step = cloud.width * kPointStep;
  cloud.is_dense = 1;
  cloud.is_bigendian = 0;
  return cloud;
}

/// Runs PCL's writer on the temporary name; PCL reports failure by a negative number or by an exception.
template <class Write>
void write_checked(const std::filesystem::path& file, Write&& write) {
  FileOutput output(file);
  int result = -1;
  std::string reason = "the point cloud library refused";
  try {
    result = write(output.temporary_path().string());
  } catch (const std::exception& error) {
    reason = error.what();
  }
  if (result < 0) throw std::runtime_error(std::format("cannot write {}: {}", file.string(), reason));
  output.commit();
}

/// PCL refuses to write a PLY file without points.
void write_empty_ply(const std::filesystem::path& file) {
  FileOutput output(file);
  output.stream() << "ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
                     "property float z\nproperty float intensity\nproperty uchar level\nend_header\n";
  output.commit();
}

}  // namespace

void write_pcd(const std::filesystem::path& file, const ThreeLevelMap& map) {
  const pcl::PCLPointCloud2 cloud = to_cloud(map);
  write_checked(file, [&](const std::string& name) {
    return pcl::PCDWriter().writeBinary(name, cloud, Eigen::Vector4f::Zero(), Eigen::Quaternionf::Identity());
  });
}

void write_ply(const std::filesystem::path& file, const ThreeLevelMap& map) {
  const pcl::PCLPointCloud2 cloud = to_cloud(map);
  if (cloud.width == 0) {
    write_empty_ply(file);
    return;
  }
  write_checked(file, [&](const std::string& name) {
    return pcl::PLYWriter().writeBinary(name, cloud, Eigen::Vector4f::Zero(), Eigen::Quaternionf::Identity(), false);
  });
}

}  // namespace ignis
