// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/loose_odometry.h"

namespace ignis {

WhiteningRows loose_rows(const BackendConfig& config) {
  Vector6d information;
  information << Eigen::Vector3d::Constant(1.0 / (config.loose_rotation_rad * config.loose_rotation_rad)),
      Eigen::Vector3d::Constant(1.0 / (config.loose_position_m * config.loose_position_m));
  return whitening(information.asDiagonal());
}

}  // namespace ignis
