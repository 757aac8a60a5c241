// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/planar_pose_factor.h"

#include <gtsam/nonlinear/NonlinearFactor.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "backend/factors/gtsam_conversion.h"
#include "backend/pose_graph/planar_pose.h"

namespace ignis {
namespace {

constexpr double kNothing = 1e-12;  // share of the strongest direction

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// As whitening() is of a pose in space.
Rows square_root(const Eigen::Matrix3d& information) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(information);
  Rows rows(3, 3);
  Eigen::Index count = 0;
  for (int i = 0; i < 3; ++i) {
    const double value = eigen.eigenvalues()(i);
    if (value <= kNothing * eigen.eigenvalues()(2)) continue;
    rows.row(count++) = std::sqrt(value) * eigen.eigenvectors().col(i).transpose();
  }
  return rows.topRows(count);
}

class PlanarPoseFactor : public gtsam::NoiseModelFactorN<PlanarPose, PlanarPose> {
 public:
  PlanarPoseFactor(gtsam::Key from, gtsam::Key to, const gtsam::Pose2& T_from_to, Rows rows, PlanarError error)
      : NoiseModelFactorN(gtsam::noiseModel::Unit::Create(static_cast<std::size_t>(rows.rows())), from, to),
        T_from_to_(T_from_to),
        rows_(std::move(rows)),
        error_(error) {}

  gtsam::NonlinearFactor::shared_ptr clone() const override { return boost::make_shared<PlanarPoseFactor>(*this); }

  gtsam::Vector evaluateError(const PlanarPose& T_map_from, const PlanarPose& T_map_to,
                              boost::optional<gtsam::Matrix&> H_from,
                              boost::optional<gtsam::Matrix&> H_to) const override {
    gtsam::Matrix3 between_from;
    const gtsam::Pose2 T_from_to = T_map_from.pose.between(T_map_to.pose, between_from);
    gtsam::Matrix3 error_to;
    const gtsam::Vector3 error = error_of(T_from_to_.between(T_from_to), error_to);
    if (H_from) *H_from = rows_ * error_to * between_from;
    if (H_to) *H_to = rows_ * error_to;
    return rows_ * error;
  }

 private:
  [[nodiscard]] gtsam::Vector3 error_of(const gtsam::Pose2& off, gtsam::Matrix3& H) const {
    if (error_ == PlanarError::kLogarithm) return gtsam::Pose2::Logmap(off, H);
    H.setIdentity();
    H.topLeftCorner<2, 2>() = off.rotation().matrix();
    return {off.x(), off.y(), off.theta()};
  }

  gtsam::Pose2 T_from_to_;
  Rows rows_;
  PlanarError error_;
};

}  // namespace

boost::shared_ptr<gtsam::NonlinearFactor> make_planar_pose_factor(std::uint64_t from_key, std::uint64_t to_key,
                                                                  const Pose& T_from_to,
                                                                  const Eigen::Matrix3d& information,
                                                                  PlanarError error) {
  return boost::make_shared<PlanarPoseFactor>(from_key, to_key, to_planar_gtsam(T_from_to), square_root(information),
                                              error);
}

}  // namespace ignis
