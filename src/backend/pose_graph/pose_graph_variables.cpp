// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/pose_graph_variables.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/PriorFactor.h>
#include <gtsam/nonlinear/Values.h>

#include <array>

#include "backend/factors/gtsam_conversion.h"
#include "backend/factors/information.h"
#include "backend/factors/relative_pose_factor.h"
#include "backend/pose_graph/planar_pose.h"
#include "backend/pose_graph/planar_pose_factor.h"

namespace ignis {
namespace {

constexpr double kHoldSigma = 1e-6;
constexpr std::array<int, 3> kPlanarRows{3, 4, 2};  // x, y, heading in a pose's tangent space

}  // namespace

std::uint64_t PoseGraphVariables::key_of(std::int32_t id) const {
  return gtsam::Symbol(planar_ ? 'p' : 'x', static_cast<std::uint32_t>(id));
}

void PoseGraphVariables::insert(std::int32_t id, const Pose& T_map_body, gtsam::Values& values) const {
  if (planar_) {
    values.insert(key_of(id), PlanarPose{to_planar_gtsam(T_map_body)});
  } else {
    values.insert(key_of(id), to_gtsam(T_map_body));
  }
}

Pose PoseGraphVariables::pose_in(const gtsam::Values& values, std::int32_t id) const {
  return planar_ ? from_gtsam(values.at<PlanarPose>(key_of(id)).pose) : from_gtsam(values.at<gtsam::Pose3>(key_of(id)));
}

boost::shared_ptr<gtsam::NonlinearFactor> PoseGraphVariables::factor_of(const PoseGraphEdge& edge) const {
  if (planar_) return planar_factor_of(edge, PlanarError::kLogarithm);
  return make_relative_pose_factor(key_of(edge.from), key_of(edge.to), edge.T_from_to, whitening(edge.information));
}

boost::shared_ptr<gtsam::NonlinearFactor> PoseGraphVariables::cost_of(const PoseGraphEdge& edge) const {
  return planar_ ? planar_factor_of(edge, PlanarError::kCoordinates) : factor_of(edge);
}

boost::shared_ptr<gtsam::NonlinearFactor> PoseGraphVariables::planar_factor_of(const PoseGraphEdge& edge,
                                                                               PlanarError error) const {
  const Eigen::Matrix3d information = edge.information(kPlanarRows, kPlanarRows);
  return make_planar_pose_factor(key_of(edge.from), key_of(edge.to), edge.T_from_to, information, error);
}

boost::shared_ptr<gtsam::NonlinearFactor> PoseGraphVariables::hold_of(const KeyframePose& vertex) const {
  const std::uint64_t key = key_of(vertex.id);
  if (planar_) {
    return boost::make_shared<gtsam::PriorFactor<PlanarPose>>(key, PlanarPose{to_planar_gtsam(vertex.T_map_body)},
                                                              gtsam::noiseModel::Isotropic::Sigma(3, kHoldSigma));
  }
  return boost::make_shared<gtsam::PriorFactor<gtsam::Pose3>>(key, to_gtsam(vertex.T_map_body),
                                                              gtsam::noiseModel::Isotropic::Sigma(6, kHoldSigma));
}

}  // namespace ignis
