// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_matcher.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <format>
#include <numbers>
#include <optional>
#include <vector>

#include "common/plane_smoothness.h"
#include "common/so3.h"

namespace ignis {
namespace {

constexpr double kRadiusShrink = 0.8;          // per iteration
constexpr double kCoarseVoxelPerRadius = 0.5;  // side of the large voxels relative to the first search radius
constexpr double kConvergedPosition = 5e-4;    // [m] step below which the alignment stands
constexpr double kConvergedRotation = 2e-4;    // [rad]
constexpr double kKernelPerRadius = 0.2;       // width of the Cauchy kernel relative to the search radius
constexpr double kAgreeingCosine = 0.87;       // 30 degrees between a point's own normal and the map's
constexpr double kWallCosine = 0.5;            // a surface whose normal is at least 60 degrees from the body's up
constexpr int kFullSteps = 6;                  // at the last radius
// An alignment is given up when, after so many iterations at the last radius, it is as far from passing as this.
constexpr int kIterationsUntilHopeless = 4;
constexpr double kHopelessFraction = 0.6;    // of what must be matched
constexpr double kHopelessCorrection = 1.5;  // times the largest one allowed

bool on_wall(const SurfacePoint& point) { return point.normal && std::abs(point.normal->y()) < kWallCosine; }

bool agree(const SurfacePoint& point, const Eigen::Vector3d& normal) {
  return !point.normal || std::abs(point.normal->dot(normal)) > kAgreeingCosine;
}

/// Normal equations of the point-to-plane distances, perturbing the source pose in its body axes.
struct NormalEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  double weighted_square = 0.0;  ///< sum of w r^2
  double weight = 0.0;           ///< sum of w
  double absolute = 0.0;         ///< sum of |r|
  int points = 0;
  int walls = 0;
  int matched = 0;
  int walls_matched = 0;
};

/// What a plane and a residual count for.
double weight_of(const SurfacePlane& plane, double residual, double radius_m, const LoopMatcherConfig& config) {
  const double kernel = kKernelPerRadius * radius_m;
  return plane_smoothness(plane.variance, config.smooth_plane_m) / (1.0 + residual * residual / (kernel * kernel));
}

/// Of every `stride`-th point.
NormalEquations accumulate(std::span<const SurfacePoint> source, std::size_t stride, PlaneMap& map,
                           const Pose& T_map_source, double radius_m, const LoopMatcherConfig& config) {
  const Eigen::Matrix3d R_map_source = T_map_source.rotation.toRotationMatrix();
  const Eigen::Matrix3d R_source_map = R_map_source.transpose();
  NormalEquations sum;
  for (std::size_t i = 0; i < source.size(); i += stride) {
    const SurfacePoint& point = source[i];
    const Eigen::Vector3d& p_source = point.position;
    const Eigen::Vector3d p_map = R_map_source * p_source + T_map_source.translation;
    ++sum.points;
    if (on_wall(point)) ++sum.walls;
    const std::optional<SurfacePlane> plane = map.nearest_plane(p_map, radius_m);
    if (!plane) continue;
    const double residual = plane->normal.dot(p_map - plane->centre);
    const Eigen::Vector3d n_source = R_source_map * plane->normal;
    if (!agree(point, n_source)) continue;
    Vector6d J;
    J << p_source.cross(n_source), n_source;
    const double weight = weight_of(*plane, residual, radius_m, config);
    sum.H += weight * J * J.transpose();
    sum.b -= weight * residual * J;
    sum.weighted_square += weight * residual * residual;
    sum.weight += weight;
    sum.absolute += std::abs(residual);
    ++sum.matched;
    if (on_wall(point)) ++sum.walls_matched;
  }
  return sum;
}

/// The well-observed part of the normal equations. Rotation is scaled by a length so that all directions compare.
struct ObservedPart {
  Vector6d step = Vector6d::Zero();
  Matrix6d H = Matrix6d::Zero();
  int directions = 0;
};

ObservedPart observed_part(const NormalEquations& equations, double length_m, double degenerate_ratio) {
  Vector6d unit;
  unit << Eigen::Vector3d::Constant(1.0 / length_m), Eigen::Vector3d::Ones();
  const Matrix6d H = unit.asDiagonal() * equations.H * unit.asDiagonal();
  const Vector6d b = unit.asDiagonal() * equations.b;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(H);
  ObservedPart part;
  for (int i = 0; i < 6; ++i) {
    const double strength = eigen.eigenvalues()(i);
    if (strength <= degenerate_ratio * equations.weight || strength <= 0.0) continue;
    const Vector6d direction = eigen.eigenvectors().col(i);
    part.step += direction * (direction.dot(b) / strength);
    part.H += strength * direction * direction.transpose();
    ++part.directions;
  }
  part.step = unit.asDiagonal() * part.step;
  part.H = unit.cwiseInverse().asDiagonal() * part.H * unit.cwiseInverse().asDiagonal();
  return part;
}

/// Points that cross from one voxel to another and back can keep an alignment swinging; steps that shrink as 1/n end
/// it.
double step_share(int at_last_radius) { return 1.0 / std::max(1, at_last_radius - kFullSteps); }

double rms_range(std::span<const SurfacePoint> points) {
  double sum = 0.0;
  for (const SurfacePoint& point : points) sum += point.position.squaredNorm();
  return std::max(0.1, std::sqrt(sum / static_cast<double>(points.size())));
}

PlaneGates gates_of(const LoopMatcherConfig& config) { return {config.plane_thickness_m, config.plane_min_points}; }

PlaneMap surfaces_of(std::span<const CloudPoint> cloud, const LoopMatcherConfig& config) {
  const CloudInMap in_place{cloud, Pose()};
  return {std::span(&in_place, 1), config.voxel_m, gates_of(config)};
}

/// The first point of each voxel, with the direction of its surface.
std::vector<SurfacePoint> surface_points(PlaneMap& surfaces) {
  std::vector<SurfacePoint> found;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const auto plane = surfaces.plane(i);
    found.push_back({surfaces.first_point(i), plane ? std::optional(plane->normal) : std::nullopt});
  }
  return found;
}

/// Of the map's upright surfaces that the source would show, the fraction that it shows; of all surfaces where none is
/// upright, for a floor lies under any place. Nothing to show counts as nothing shown.
double overlap(LoopSource& source, PlaneMap& map, const Pose& T_map_source, const LoopMatcherConfig& config) {
  struct Count {
    int would_show = 0;
    int shown = 0;
  };
  Count all;
  Count upright;
  const Pose T_source_map = T_map_source.inverse();
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Eigen::Vector3d p_source = T_source_map * map.first_point(i);
    if (!source.view.would_show(p_source, config.last_radius_m)) continue;
    const auto map_plane = map.plane(i);
    if (!map_plane) continue;
    const SurfacePoint surface{p_source, T_source_map.rotation * map_plane->normal};
    const auto plane = source.surfaces.nearest_plane(p_source, config.last_radius_m);
    // Too few points for a plane say neither yes nor no.
    if (!plane && source.surfaces.has_points_near(p_source, config.last_radius_m)) continue;
    const bool shown = plane && agree(surface, plane->normal);
    for (Count* count : {&all, &upright}) {
      if (count == &upright && !on_wall(surface)) continue;
      ++count->would_show;
      if (shown) ++count->shown;
    }
  }
  const Count& counted = upright.would_show > 0 ? upright : all;
  return counted.would_show > 0 ? static_cast<double>(counted.shown) / counted.would_show : 0.0;
}

/// How much of the source has found its like, and how far the alignment has moved it.
void note_agreement(LoopMatch& match, const NormalEquations& sum, const Pose& T_predicted) {
  match.matched_fraction = static_cast<double>(sum.matched) / sum.points;
  // Without upright surfaces nothing was asked of them; the count of directions then decides.
  match.wall_fraction = sum.walls > 0 ? static_cast<double>(sum.walls_matched) / sum.walls : 1.0;
  match.mean_residual = sum.matched > 0 ? sum.absolute / sum.matched : 0.0;
  const Vector6d correction = body_difference(T_predicted, match.T_map_source);
  match.correction_rad = correction.head<3>().norm();
  match.correction_m = correction.tail<3>().norm();
}

/// More iterations will not make a loop of this: far too little matches, or it has run away.
bool hopeless(const LoopMatch& match, const LoopMatcherConfig& config, const LoopGates& gates) {
  return match.matched_fraction < kHopelessFraction * gates.loop_match_min_frac ||
         match.wall_fraction < kHopelessFraction * config.min_wall_fraction ||
         match.correction_m > kHopelessCorrection * gates.loop_max_correction_m;
}

void judge(LoopMatch& match, bool converged, const LoopMatcherConfig& config, const LoopGates& gates) {
  if (match.matched_fraction < gates.loop_match_min_frac) {
    match.reason = LoopReason::kTooFewMatched;
    match.reason_text = std::format("{:.0f} % of the points found a plane, at least {:.0f} % are needed",
                                    100.0 * match.matched_fraction, 100.0 * gates.loop_match_min_frac);
  } else if (match.wall_fraction < config.min_wall_fraction) {
    match.reason = LoopReason::kTooFewMatched;
    match.reason_text = std::format("{:.0f} % of the upright surfaces found their like, at least {:.0f} % are needed",
                                    100.0 * match.wall_fraction, 100.0 * config.min_wall_fraction);
  } else if (match.overlap < config.min_overlap) {
    match.reason = LoopReason::kTooLittleOverlap;
    match.reason_text = std::format("the cloud shows {:.0f} % of what it would see of the candidate, at least {:.0f} %",
                                    100.0 * match.overlap, 100.0 * config.min_overlap);
  } else if (match.directions < config.min_directions) {
    match.reason = LoopReason::kDegenerate;
    match.reason_text = std::format("the geometry holds {} of 6 directions, at least {} are needed", match.directions,
                                    config.min_directions);
  } else if (match.mean_residual > gates.loop_max_mean_innovation) {
    match.reason = LoopReason::kResidualTooLarge;
    match.reason_text = std::format("mean residual {:.3f} m, at most {:.3f} m is allowed", match.mean_residual,
                                    gates.loop_max_mean_innovation);
  } else if (match.correction_m > gates.loop_max_correction_m) {
    match.reason = LoopReason::kCorrectionTooLarge;
    match.reason_text = std::format("correction {:.2f} m, at most {:.2f} m is allowed", match.correction_m,
                                    gates.loop_max_correction_m);
  } else if (!converged) {
    match.reason = LoopReason::kDidNotConverge;
    match.reason_text = std::format("no convergence in {} iterations", match.iterations);
  } else {
    match.reason = LoopReason::kAccepted;
    match.reason_text =
        std::format("{:.0f} % matched at {:.3f} m, overlap {:.0f} %, correction {:.2f} m, {} directions held",
                    100.0 * match.matched_fraction, match.mean_residual, 100.0 * match.overlap, match.correction_m,
                    match.directions);
  }
}

}  // namespace

void LoopMatcherConfig::check(config::Offences& offences, const std::string& path) const {
  if (last_radius_m > first_radius_m) {
    offences.push_back({path + ".last_radius_m", std::format("{}", last_radius_m),
                        std::format("at most first_radius_m, {}", first_radius_m)});
  }
}

LoopSource::LoopSource(std::span<const CloudPoint> cloud, const LoopMatcherConfig& config)
    : surfaces(surfaces_of(cloud, config)),
      points(surface_points(surfaces)),
      view(cloud, config.view_cell_deg * std::numbers::pi / 180.0) {}

LoopMatch match_loop(LoopSource& source, std::span<const CloudInMap> map_clouds, const Pose& T_map_source_predicted,
                     const LoopMatcherConfig& config, const LoopGates& gates) {
  LoopMatch match;
  match.T_map_source = T_map_source_predicted;
  PlaneMap map(map_clouds, config.voxel_m, gates_of(config));
  if (source.points.empty() || map.size() == 0) {
    match.reason_text = source.points.empty() ? "the keyframe has no points" : "the candidate has no points";
    return match;
  }
  const double coarse_voxel_m = kCoarseVoxelPerRadius * config.first_radius_m;
  PlaneMap coarse = map.coarser(coarse_voxel_m);
  const double length = rms_range(source.points);
  const std::size_t stride =
      std::max<std::size_t>(1, source.points.size() / static_cast<std::size_t>(config.align_points));

  bool converged = false;
  double radius = config.first_radius_m;
  int at_last_radius = 0;
  while (!converged && match.iterations < config.max_iterations) {
    const bool far_off = radius > config.last_radius_m && radius >= coarse_voxel_m;
    const NormalEquations equations =
        accumulate(source.points, stride, far_off ? coarse : map, match.T_map_source, radius, config);
    const ObservedPart part = observed_part(equations, length, config.degenerate_ratio);
    ++match.iterations;
    if (part.directions == 0) break;
    if (radius <= config.last_radius_m) ++at_last_radius;
    const Vector6d step = step_share(at_last_radius) * part.step;
    match.T_map_source = perturbed_in_body(match.T_map_source, step);
    note_agreement(match, equations, T_map_source_predicted);
    converged =
        at_last_radius > 0 && step.head<3>().norm() < kConvergedRotation && step.tail<3>().norm() < kConvergedPosition;
    if (at_last_radius >= kIterationsUntilHopeless && hopeless(match, config, gates)) break;
    radius = std::max(config.last_radius_m, kRadiusShrink * radius);
  }

  const NormalEquations final_sum = accumulate(source.points, 1, map, match.T_map_source, config.last_radius_m, config);
  const ObservedPart part = observed_part(final_sum, length, config.degenerate_ratio);
  match.directions = part.directions;
  note_agreement(match, final_sum, T_map_source_predicted);
  const bool enough_matched =
      match.matched_fraction >= gates.loop_match_min_frac && match.wall_fraction >= config.min_wall_fraction;
  // The other way round costs as much again; most candidates have failed by now.
  if (enough_matched) match.overlap = overlap(source, map, match.T_map_source, config);
  const double floor = config.noise_floor_m * config.noise_floor_m;
  const double variance =
      final_sum.weight > 0.0 ? std::max(floor, final_sum.weighted_square / final_sum.weight) : floor;
  match.information = part.H / variance;
  judge(match, converged, config, gates);
  return match;
}

}  // namespace ignis
