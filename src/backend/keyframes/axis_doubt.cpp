// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframes/axis_doubt.h"

namespace ignis {
namespace {

// [rad] One sigma. Chosen for the NEES of a bare corridor, seeds 1 to 10 (docs/results/graph_consistency.md).
constexpr double kAxisSigma = 0.0015;

}  // namespace

Matrix6d with_axis_doubt(const Matrix6d& covariance) {
  Matrix6d doubtful = covariance;
  auto position = doubtful.bottomRightCorner<3, 3>();
  // Mean of (turn x error)(turn x error)^T over turns that are equally likely about all axes.
  position +=
      kAxisSigma * kAxisSigma * (position.trace() * Eigen::Matrix3d::Identity() - covariance.bottomRightCorner<3, 3>());
  return doubtful;
}

}  // namespace ignis
