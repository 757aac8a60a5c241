// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "frontend/degeneracy.h"
#include "frontend/eskf.h"
#include "frontend/frontend_config.h"
#include "frontend/local_map.h"
#include "frontend/scan_stats.h"
#include "frontend/scan_update.h"

namespace ignis {

/// The state after a scan, and what the scan said.
struct MatchResult {
  FilterState filter;  ///< corrected, or the unchanged prediction when the scan was not applied
  ScanStats stats;     ///< reason and figures; stamps are the caller's
  /// What the scan alone says about the pose (sum of h h^T / r, observed directions only); attitude and position both
  /// in body axes. Zero when not applied.
  Matrix6d information_body = Matrix6d::Zero();
};

/// Corrects a predicted state by matching deskewed points against planes of the local map: assessment, quality gate,
/// iterated update, trust region. Pure: the map is only read.
class ScanMatcher {
 public:
  explicit ScanMatcher(const FrontendConfig& config);

  [[nodiscard]] MatchResult match(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body,
                                  const LocalMap& map);

 private:
  /// A point and the plane that it was associated with. The plane stays over the passes until the iterate has moved.
  struct Constraint {
    Eigen::Vector3d point_body;
    Eigen::Vector3d normal;  ///< odom axes
    double plane_distance;   ///< [m] normal . centroid
    double weight;           ///< observability weight, (0, 1]
  };
  struct Assessment {
    double mean_innovation = 0.0;      ///< [m]
    double expected_innovation = 0.0;  ///< [m] root mean square that the prediction's own covariance explains
    Eigen::Vector3d observability = Eigen::Vector3d::Zero();
  };

  void associate(const Pose& pose, std::span<const Eigen::Vector3f> points_body, const LocalMap& map);
  [[nodiscard]] Assessment assess(const FilterState& predicted);
  void weigh(const Eigen::Vector3d& observability);
  [[nodiscard]] double point_variance(const Pose& pose) const;
  [[nodiscard]] PoseInformation accumulate(const Pose& pose, const Matrix6d& pose_covariance) const;
  [[nodiscard]] double mean_residual(const Pose& pose) const;
  [[nodiscard]] bool iterate(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body,
                             const LocalMap& map, MatchResult& result);
  [[nodiscard]] ScanReason judge(const FilterState& predicted, const Assessment& assessment,
                                 const MatchResult& result) const;

  FrontendConfig config_;
  std::vector<Constraint> constraints_;
  DegeneracyAnalysis degeneracy_;
  double mean_range_ = 1.0;
};

}  // namespace ignis
