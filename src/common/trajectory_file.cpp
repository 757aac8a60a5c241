// SPDX-License-Identifier: Apache-2.0
#include "common/trajectory_file.h"

#include <format>
#include <sstream>
#include <stdexcept>

#include "common/file_output.h"

namespace ignis {

void write_tum(const std::filesystem::path& file, const Trajectory& trajectory) {
  FileOutput output(file);
  for (const StampedPose& row : trajectory) {
    const Eigen::Vector3d& p = row.T_world_body.translation;
    const Eigen::Quaterniond& q = row.T_world_body.rotation;
    output.stream() << std::format("{}.{:06d} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                                   row.utime / kMicrosPerSecond, row.utime % kMicrosPerSecond, p.x(), p.y(), p.z(),
                                   q.x(), q.y(), q.z(), q.w());
  }
  output.commit();
}

Trajectory read_tum(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw std::runtime_error(std::format("cannot read the trajectory {}", file.string()));
  Trajectory trajectory;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    if (line.empty() || line.front() == '#') continue;
    std::istringstream fields(line);
    double t = 0.0;
    Eigen::Vector3d p;
    Eigen::Quaterniond q;
    if (!(fields >> t >> p.x() >> p.y() >> p.z() >> q.x() >> q.y() >> q.z() >> q.w()) || q.norm() < 0.5) {
      throw std::runtime_error(std::format("{}:{}: expected `t x y z qx qy qz qw`", file.string(), number));
    }
    trajectory.push_back({to_micros(t), {q.normalized(), p}});
  }
  return trajectory;
}

}  // namespace ignis
