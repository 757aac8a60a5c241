// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/shared_ptr.hpp>
#include <cstdint>

#include "backend/pose_graph/planar_pose_factor.h"
#include "backend/pose_graph/pose_graph_file.h"

namespace gtsam {
class NonlinearFactor;
class Values;
}  // namespace gtsam

namespace ignis {

/// The vertices of a pose graph as GTSAM's variables and its edges as factors. When it is planar these are
/// poses in the plane, with half the scalars.
class PoseGraphVariables {
 public:
  explicit PoseGraphVariables(bool planar) : planar_(planar) {}

  [[nodiscard]] std::uint64_t key_of(std::int32_t id) const;
  void insert(std::int32_t id, const Pose& T_map_body, gtsam::Values& values) const;
  [[nodiscard]] Pose pose_in(const gtsam::Values& values, std::int32_t id) const;
  /// What to solve with.
  [[nodiscard]] boost::shared_ptr<gtsam::NonlinearFactor> factor_of(const PoseGraphEdge& edge) const;
  /// Whose error is the edge's share of the cost; in space the same.
  [[nodiscard]] boost::shared_ptr<gtsam::NonlinearFactor> cost_of(const PoseGraphEdge& edge) const;

  /// Holds a vertex where it is.
  [[nodiscard]] boost::shared_ptr<gtsam::NonlinearFactor> hold_of(const KeyframePose& vertex) const;

 private:
  [[nodiscard]] boost::shared_ptr<gtsam::NonlinearFactor> planar_factor_of(const PoseGraphEdge& edge,
                                                                           PlanarError error) const;

  bool planar_;
};

}  // namespace ignis
