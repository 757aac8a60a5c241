// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtsam/geometry/Pose2.h>

#include <string>

/// A pose in the plane whose tangent space is that of the group. GTSAM's Pose2 moves position and heading each by
/// itself, with which Gauss-Newton strays in graphs whose headings err by a tenth of a radian.
namespace ignis {

struct PlanarPose {
  gtsam::Pose2 pose;
};

}  // namespace ignis

template <>
struct gtsam::traits<ignis::PlanarPose> {
  using structure_category = gtsam::manifold_tag;
  using ManifoldType = ignis::PlanarPose;
  using TangentVector = gtsam::Vector3;
  enum { dimension = 3 };

  static int GetDimension(const ignis::PlanarPose&) { return dimension; }
  static TangentVector Local(const ignis::PlanarPose& from, const ignis::PlanarPose& to) {
    return gtsam::Pose2::Logmap(from.pose.between(to.pose));
  }
  static TangentVector Local(const ignis::PlanarPose& from, const ignis::PlanarPose& to,
                             gtsam::OptionalJacobian<3, 3> H_from, gtsam::OptionalJacobian<3, 3> H_to) {
    gtsam::Matrix3 between_from;
    gtsam::Matrix3 log_between;
    const TangentVector local = gtsam::Pose2::Logmap(from.pose.between(to.pose, between_from), log_between);
    if (H_from) *H_from = log_between * between_from;
    if (H_to) *H_to = log_between;
    return local;
  }
  static ignis::PlanarPose Retract(const ignis::PlanarPose& from, const TangentVector& step) {
    return {from.pose * gtsam::Pose2::Expmap(step)};
  }
  static void Print(const ignis::PlanarPose& pose, const std::string& name) { pose.pose.print(name); }
  static bool Equals(const ignis::PlanarPose& a, const ignis::PlanarPose& b, double tolerance) {
    return a.pose.equals(b.pose, tolerance);
  }
};
