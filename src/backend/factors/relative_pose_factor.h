// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/shared_ptr.hpp>
#include <cstdint>

#include "backend/factors/information.h"
#include "common/pose.h"

namespace gtsam {
class NonlinearFactor;
}

namespace ignis {

/// A relative pose T_from_to between two pose variables that constrains only the directions its whitening rows span.
/// GTSAM's own between factor needs positive definite noise, so it would have to invent knowledge in a corridor's
/// direction. Error: rows * Log(T_from_to_measured^-1 * T_from_to), body axes of `to`, rotation first.
[[nodiscard]] boost::shared_ptr<gtsam::NonlinearFactor> make_relative_pose_factor(std::uint64_t from_key,
                                                                                  std::uint64_t to_key,
                                                                                  const Pose& T_from_to,
                                                                                  const WhiteningRows& rows);

}  // namespace ignis
