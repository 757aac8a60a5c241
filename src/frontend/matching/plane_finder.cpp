// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/plane_finder.h"

#include <algorithm>

#include "frontend/planes/four_planes.h"

namespace ignis {
namespace {

// [m] Roughness up to which neighbours are taken for one face: means of many points are smoother than that. One
// neighbour in three hundred on the other side of a wall of 0.1 m makes as much.
constexpr double kOneFace = 0.006;

bool may_be_two_faces(const PlaneFit& plane, const Eigen::Vector3d& view) {
  return plane.scatter[0] > kOneFace * kOneFace && is_side_clear(plane, view);
}

}  // namespace

PlaneFinder::PlaneFinder(const FrontendConfig& config) : config_(config), wide_config_(config) {
  // A wide neighbourhood reaches round corners and over tree crowns: it has to be flatter to count as a plane.
  wide_config_.max_surface_roughness *= 0.5;
  wide_config_.max_curvature /= 3.0;
}

std::span<const PlaneFit> PlaneFinder::find(const LocalMap& map, std::span<const Eigen::Vector3d> queries,
                                            const Eigen::Vector3d& seen_from) {
  choose_all(queries.size());
  fit_chosen(map, queries, seen_from, config_, config_.match_radius_m);
  const double radius = config_.wide_match_radius_m;
  if (!(radius > 0.0)) return planes_;
  chosen_.clear();
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    if (planes_[i].verdict == PlaneVerdict::kTooFewPoints) chosen_.push_back(i);
  }
  fit_chosen(map, queries, seen_from, wide_config_, radius);
  return planes_;
}

std::span<const PlaneFit> PlaneFinder::find_across_lines(const LocalMap& map, std::span<const Eigen::Vector3d> queries,
                                                         const Eigen::Vector3d& seen_from) {
  choose_all(queries.size());
  fit_chosen(map, queries, seen_from, wide_config_, config_.line_match_radius_m);
  return planes_;
}

void PlaneFinder::choose_all(std::size_t queries) {
  planes_.resize(queries);
  chosen_.clear();
  for (std::size_t i = 0; i < queries; ++i) chosen_.push_back(i);
}

/// Planes of the chosen queries. Where one was seen from its other side, or what it is made of may be the two faces of
/// a wall, it is that of the points seen from this side.
void PlaneFinder::fit_chosen(const LocalMap& map, std::span<const Eigen::Vector3d> queries,
                             const Eigen::Vector3d& seen_from, const FrontendConfig& config, double radius) {
  fit(map, queries, config, radius, {});
  sides_.clear();
  std::erase_if(chosen_, [&](std::size_t i) {
    const Eigen::Vector3d view = seen_from - queries[i];
    const bool has_faces = config.map_two_faces && may_be_two_faces(planes_[i], view);
    const bool is_narrowed = has_faces || is_seen_from_other_side(planes_[i], view);
    if (is_narrowed) sides_.push_back(side_of(planes_[i], view));
    return !is_narrowed;
  });
  if (!chosen_.empty()) fit(map, queries, config, radius, sides_);
}

void PlaneFinder::fit(const LocalMap& map, std::span<const Eigen::Vector3d> queries, const FrontendConfig& config,
                      double radius, std::span<const Eigen::Vector3d> sides) {
  chosen_queries_.clear();
  chosen_planes_.clear();
  for (const std::size_t i : chosen_) {
    chosen_queries_.push_back(queries[i]);
    chosen_planes_.push_back(&planes_[i]);
  }
  std::span<PlaneFit* const> left = chosen_planes_;
  for (const FourMoments& moments : search_.gather(map, chosen_queries_, radius, sides)) {
    const auto four = left.first(std::min<std::size_t>(kLanes, left.size()));
    fit_four_planes(moments, config, radius, four);
    left = left.subspan(four.size());
  }
}

}  // namespace ignis
