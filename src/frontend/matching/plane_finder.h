// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "frontend/frontend_config.h"
#include "frontend/local_map/local_map.h"
#include "frontend/local_map/neighbour_search.h"
#include "frontend/planes/plane_fit.h"

namespace ignis {

/// The planes of the local map nearest to points of a scan. Keeps its memory from scan to scan.
class PlaneFinder {
 public:
  explicit PlaneFinder(const FrontendConfig& config);

  /// One for each query [m, odom frame], as seen from a point; valid until the next call. Where the neighbourhood
  /// within match_radius_m holds too few points, the plane is sought within wide_match_radius_m: far surfaces are
  /// sparse, and a small neighbourhood keeps edges sharp where the map is dense.
  [[nodiscard]] std::span<const PlaneFit> find(const LocalMap& map, std::span<const Eigen::Vector3d> queries,
                                               const Eigen::Vector3d& seen_from);
  /// The same within line_match_radius_m, for points whose near neighbours make a line: a beam draws one on a floor, a
  /// step further the next beam another, and both together are a plane. Only where line_match_radius_m is not 0.
  [[nodiscard]] std::span<const PlaneFit> find_across_lines(const LocalMap& map,
                                                            std::span<const Eigen::Vector3d> queries,
                                                            const Eigen::Vector3d& seen_from);

 private:
  void choose_all(std::size_t queries);
  void fit_chosen(const LocalMap& map, std::span<const Eigen::Vector3d> queries, const Eigen::Vector3d& seen_from,
                  const FrontendConfig& config, double radius);
  void fit(const LocalMap& map, std::span<const Eigen::Vector3d> queries, const FrontendConfig& config, double radius,
           std::span<const Eigen::Vector3d> sides);

  FrontendConfig config_;
  FrontendConfig wide_config_;  ///< gates of planes in a wide neighbourhood
  NeighbourSearch search_;
  std::vector<PlaneFit> planes_;     ///< [query]
  std::vector<std::size_t> chosen_;  ///< those of the queries that planes are sought for
  std::vector<Eigen::Vector3d> chosen_queries_;
  std::vector<PlaneFit*> chosen_planes_;  ///< those of planes_ that go with them
  std::vector<Eigen::Vector3d> sides_;    ///< normals that point to the side that they are seen from
};

}  // namespace ignis
