// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <boost/shared_ptr.hpp>
#include <cstdint>

#include "common/pose.h"

namespace gtsam {
class NonlinearFactor;
}

namespace ignis {

/// Of T_from_to_measured^-1 * T_from_to.
enum class PlanarError : std::uint8_t {
  kLogarithm,    ///< what Gauss-Newton finds its way with
  kCoordinates,  ///< x, y, heading: what GTSAM and g2o call the cost of a planar graph
};

/// A relative pose T_from_to between two PlanarPose; of T_from_to only x, y and the heading count, weighed by
/// `information`, which may leave directions free.
[[nodiscard]] boost::shared_ptr<gtsam::NonlinearFactor> make_planar_pose_factor(std::uint64_t from_key,
                                                                                std::uint64_t to_key,
                                                                                const Pose& T_from_to,
                                                                                const Eigen::Matrix3d& information,
                                                                                PlanarError error);

}  // namespace ignis
