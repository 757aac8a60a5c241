// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include <Eigen/Core>

#include "map/client_request.h"

namespace ignis {

/// The clouds of both keyframes of a loop: the announcing text and the binary message of docs/wire_format.md.
struct LoopClouds {
  std::string text;
  std::string bytes;
};

/// Points in frame map [m]. Of a cloud above kMaxLoopCloudPoints every n-th point is taken.
inline constexpr std::size_t kMaxLoopCloudPoints = 20'000;
[[nodiscard]] LoopClouds encode_loop_clouds(const LoopCloudsRequest& loop, std::span<const Eigen::Vector3f> from,
                                            std::span<const Eigen::Vector3f> to);

}  // namespace ignis
