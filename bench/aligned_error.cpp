// SPDX-License-Identifier: Apache-2.0
#include "aligned_error.h"

#include <Eigen/Geometry>
#include <cmath>

namespace ignis::bench {

double aligned_error(const std::vector<Pose>& estimate, const std::vector<Pose>& truth) {
  Eigen::Matrix3Xd a(3, estimate.size());
  Eigen::Matrix3Xd b(3, truth.size());
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    a.col(static_cast<Eigen::Index>(i)) = estimate[i].translation;
    b.col(static_cast<Eigen::Index>(i)) = truth[i].translation;
  }
  const Eigen::Matrix4d T = Eigen::umeyama(a, b, false);
  const Eigen::Matrix3Xd rest = ((T.topLeftCorner<3, 3>() * a).colwise() + T.topRightCorner<3, 1>().eval().col(0)) - b;
  return std::sqrt(rest.colwise().squaredNorm().mean());
}

}  // namespace ignis::bench
