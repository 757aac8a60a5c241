// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "backend/loops/loop_result.h"
#include "backend/loops/plane_map.h"
#include "backend/loops/view_grid.h"
#include "common/config_fields.h"
#include "common/loop_gates.h"
#include "common/measurements.h"
#include "common/pose.h"

namespace ignis {

/// Parameters of the scan match that confirms a loop.
struct LoopMatcherConfig {
  int max_iterations = 40;
  int neighbours = 2;               ///< keyframes on either side of the candidate that enter its local map
  int align_points = 1500;          ///< of the keyframe that looks, about so many are aligned; all are counted
  double voxel_m = 0.25;            ///< a plane is fitted to 3 x 3 x 3 of them; one point of each is aligned
  double first_radius_m = 2.0;      ///< search radius of the first iteration
  double last_radius_m = 0.5;       ///< search radius at the end; a matched point has a plane within it
  double plane_thickness_m = 0.08;  ///< largest standard deviation across a plane
  int plane_min_points = 6;         ///< fewest points of a plane
  double smooth_plane_m = 0.0;      ///< a plane with this standard deviation counts half; 0: all count alike
  double degenerate_ratio = 0.01;   ///< a direction below this share of the matched points' weight is left free
  int min_directions = 5;           ///< fewest directions that the geometry must hold: a wall beside the floor
  double min_wall_fraction = 0.5;   ///< upright surfaces that must find their like; a floor fits any other floor
  double min_overlap = 0.4;         ///< of what the current cloud would show of the local map, how much it must show
  double view_cell_deg = 3.0;       ///< side of a cell of the grid of directions that decides what would be shown
  double noise_floor_m = 0.01;      ///< smallest point noise that the information may assume

  void visit_fields(this auto& self, auto& visit) {
    visit.integer("max_iterations", self.max_iterations, {1, 500}, "1", "iterations of the alignment at most");
    visit.integer("neighbours", self.neighbours, {0, 20}, "keyframes",
                  "keyframes on either side of the candidate in its local map");
    visit.integer("align_points", self.align_points, {50, 1000000}, "points",
                  "of the keyframe that looks, about so many are aligned; the result is judged by all");
    visit.number("voxel_m", self.voxel_m, {0.02, 2.0}, "m",
                 "side of a voxel: a plane is fitted to 3 x 3 x 3 of them, and one point of each is aligned");
    visit.number("first_radius_m", self.first_radius_m, {0.05, 10.0}, "m", "search radius of the first iteration");
    visit.number("last_radius_m", self.last_radius_m, {0.05, 10.0}, "m", "search radius of the last iterations");
    visit.number("plane_thickness_m", self.plane_thickness_m, {0.001, 1.0}, "m",
                 "largest standard deviation across a plane");
    visit.integer("plane_min_points", self.plane_min_points, {3, 1000}, "points", "fewest points of a plane");
    visit.number("smooth_plane_m", self.smooth_plane_m, {0.0, 1.0}, "m",
                 "a plane with this standard deviation across it counts half as much as a perfect one; 0: all alike");
    visit.number("degenerate_ratio", self.degenerate_ratio, {0.0, 0.3}, "1",
                 "directions that hold less than this share of the matched points are left free");
    visit.integer("min_directions", self.min_directions, {1, 6}, "1", "fewest directions that the geometry must hold");
    visit.number("min_wall_fraction", self.min_wall_fraction, {0.0, 1.0}, "1",
                 "fraction of the points on upright surfaces that must find a plane of like direction");
    visit.number("min_overlap", self.min_overlap, {0.0, 1.0}, "1",
                 "of the local map that the current cloud would show, the fraction that must lie on its planes");
    visit.number("view_cell_deg", self.view_cell_deg, {0.5, 30.0}, "deg",
                 "side of a cell of the grid of directions that tells what the current cloud would show");
    visit.number("noise_floor_m", self.noise_floor_m, {1e-4, 1.0}, "m", "smallest point noise assumed");
  }
  void check(config::Offences& offences, const std::string& path) const;
};

/// A point and the direction of the surface it lies on, where that is known. Body axes.
struct SurfacePoint {
  Eigen::Vector3d position;
  std::optional<Eigen::Vector3d> normal;
};

/// The keyframe that looks, prepared once for all candidates.
struct LoopSource {
  LoopSource(std::span<const CloudPoint> cloud, const LoopMatcherConfig& config);

  PlaneMap surfaces;                 ///< of the whole cloud
  std::vector<SurfacePoint> points;  ///< one per voxel of it, to be aligned
  ViewGrid view;
};

/// What the match found. The pose and the figures are filled for a refused match too.
struct LoopMatch {
  LoopReason reason = LoopReason::kTooFewMatched;
  std::string reason_text;
  Pose T_map_source;
  Matrix6d information = Matrix6d::Zero();  ///< of the match alone; attitude then position, body axes of the source
  int directions = 0;                       ///< directions that the geometry holds, 0..6
  double matched_fraction = 0.0;
  double wall_fraction = 0.0;  ///< the same among points on upright surfaces
  double overlap = 0.0;        ///< of the local map's surfaces that the source would show, those it does show; 0 when
                               ///< too few points matched to ask
  double mean_residual = 0.0;  ///< [m] mean absolute point-to-plane distance of the matched points
  double correction_m = 0.0;   ///< translation from the prediction to the result
  double correction_rad = 0.0;
  int iterations = 0;

  [[nodiscard]] bool verified() const { return reason == LoopReason::kAccepted; }
};

/// Aligns `source` with the local map `map_clouds` (any frame) by point-to-plane Gauss-Newton with Cauchy weights and a
/// search radius that narrows, first among large voxels, then among small ones; beginning at `T_map_source` predicted.
/// Then applies the gates. Directions in which the geometry says nothing keep the prediction and get no information (J.
/// Zhang, M. Kaess, S. Singh, "On degeneracy of optimization-based state estimation problems", ICRA 2016).
///
/// A point counts as matched when the map has a plane there (PlaneMap) whose direction agrees with that of the point's
/// own surroundings, where those are planar. The overlap asks the other way round, so that a
/// bare corner that fits into any room is not enough: of the map's surfaces that lie in the view of the source and are
/// not hidden from it, how many lie on planes of the source?
[[nodiscard]] LoopMatch match_loop(LoopSource& source, std::span<const CloudInMap> map_clouds,
                                   const Pose& T_map_source_predicted, const LoopMatcherConfig& config,
                                   const LoopGates& gates);

}  // namespace ignis
