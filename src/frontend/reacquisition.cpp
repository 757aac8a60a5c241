// SPDX-License-Identifier: Apache-2.0
#include "frontend/reacquisition.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "frontend/plane_fit.h"
#include "frontend/scan_update.h"

namespace ignis {
namespace {

constexpr double kSigmas = 4.0;
constexpr double kLargestRadiusVoxels = 20.0;  // beyond, planes of another place are as near
constexpr double kShrink = 0.8;                // of the radius, per pass
constexpr int kMostPasses = 30;
constexpr double kNoisePerRadius = 0.25;  // sigma of a distance while the pairs are still guesses
constexpr double kIndependent = 50.0;     // planes that a scan amounts to: neighbouring points repeat one another

double largest_position_sigma(const ErrorCovariance& covariance) {
  return std::sqrt(covariance.diagonal().segment<3>(kPosition).maxCoeff());
}

/// Distances of the points from the planes at their nearest map points.
PoseInformation paired(const Pose& pose, std::span<const Eigen::Vector3f> points_body, const LocalMap& map,
                       double radius, const FrontendConfig& config) {
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  const double sigma = kNoisePerRadius * radius;
  const double variance = sigma * sigma * std::max(1.0, static_cast<double>(points_body.size()) / kIndependent);
  PoseInformation sum;
  for (const Eigen::Vector3f& point : points_body) {
    const Eigen::Vector3d point_body = point.cast<double>();
    const Eigen::Vector3d query = R * point_body + pose.translation;
    const std::optional<Eigen::Vector3d> nearest = map.nearest(query, radius);
    if (!nearest) continue;
    const PlaneFit plane =
        fit_plane(map.gather(*nearest, 2.0 * config.match_radius_m), config, 2.0 * config.match_radius_m);
    if (plane.verdict != PlaneVerdict::kPlane) continue;
    Vector6d h;
    h << point_body.cross(R.transpose() * plane.normal), plane.normal;
    sum.add(h, plane.normal.dot(query - *nearest - plane.offset), variance);
  }
  return sum;
}

}  // namespace

Pose reacquire(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body, const LocalMap& map,
               const FrontendConfig& config) {
  const double finest = std::max(config.match_radius_m, config.wide_match_radius_m);
  double radius =
      std::min(kSigmas * largest_position_sigma(predicted.covariance), kLargestRadiusVoxels * config.voxel_size_m);
  NavState state = predicted.nominal;
  for (int pass = 0; pass < kMostPasses && radius > finest; ++pass, radius *= kShrink) {
    const PoseInformation pairs = paired(state.T_odom_body, points_body, map, radius, config);
    if (pairs.count < config.min_matches) break;
    const UpdateStep update = information_update(predicted.covariance, difference(predicted.nominal, state), pairs);
    if (!update.ok) break;
    state = perturbed(state, update.step);
  }
  return state.T_odom_body;
}

}  // namespace ignis
