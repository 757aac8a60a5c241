// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "common/pose.h"
#include "common/time.h"

namespace ignis {

struct StampedPose {
  Utime utime = 0;    ///< [us]
  Pose T_world_body;  ///< the frame is the file's
};

using Trajectory = std::vector<StampedPose>;

/// Writes a TUM trajectory: `t x y z qx qy qz qw`, t in seconds with six decimals taken from the integer stamp.
void write_tum(const std::filesystem::path& file, const Trajectory& trajectory);

/// Reads a TUM trajectory; lines that begin with # are comments. Throws std::runtime_error naming file and line.
[[nodiscard]] Trajectory read_tum(const std::filesystem::path& file);

}  // namespace ignis
