// SPDX-License-Identifier: Apache-2.0
#include "frontend/plane_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "frontend/scatter_axes.h"

namespace ignis {
namespace {

constexpr std::size_t kTogether = 4;  // see scatter_axes

Eigen::Matrix3d scatter_of(const NeighbourMoments& moments) {
  const double inverse_count = 1.0 / moments.count;
  const Eigen::Vector3d mean = moments.sum * inverse_count;
  return moments.sum_outer * inverse_count - mean * mean.transpose();
}

PlaneFit judged(const NeighbourMoments& moments, const ScatterAxes& axes, const FrontendConfig& config, double radius) {
  PlaneFit fit;
  const double inverse_count = 1.0 / moments.count;
  fit.offset = moments.sum * inverse_count;
  const Eigen::Vector3d lambda = axes.values.cwiseMax(0.0);
  fit.normal = axes.vectors.col(0);
  fit.count = moments.count;
  fit.scatter = lambda;
  fit.mean_scan = moments.scan_sum * inverse_count;

  const double tangential = (fit.offset - fit.normal * fit.normal.dot(fit.offset)).norm();
  if (!(lambda[0] < config.max_curvature * lambda[2])) {
    fit.verdict = PlaneVerdict::kBlob;
  } else if (!(lambda[1] > config.min_spread * lambda[2])) {
    fit.verdict = PlaneVerdict::kLine;
  } else if (!(tangential <= config.max_centroid_offset * radius)) {
    fit.verdict = PlaneVerdict::kOneSided;
  } else if (!(std::sqrt(lambda[0]) <= config.max_surface_roughness)) {
    fit.verdict = PlaneVerdict::kRough;
  } else {
    fit.verdict = PlaneVerdict::kPlane;
    // Three degrees of freedom went into the plane itself.
    const double across = lambda[0] / std::max(moments.count - 3, 1);
    fit.normal_sigma.col(0) = std::sqrt(across / lambda[1]) * axes.vectors.col(1);
    fit.normal_sigma.col(1) = std::sqrt(across / lambda[2]) * axes.vectors.col(2);
  }
  return fit;
}

}  // namespace

PlaneFit fit_plane(const NeighbourMoments& moments, const FrontendConfig& config, double radius) {
  if (moments.count < config.min_plane_points) return {};
  return judged(moments, scatter_axes(scatter_of(moments)), config, radius);
}

void fit_planes(std::span<const NeighbourMoments> neighbourhoods, const FrontendConfig& config, double radius,
                std::vector<PlaneFit>& planes) {
  planes.assign(neighbourhoods.size(), {});
  std::array<Eigen::Matrix3d, kTogether> scatters;
  std::array<std::size_t, kTogether> places{};
  std::size_t waiting = 0;
  const auto fit_waiting = [&] {
    std::array<ScatterAxes, kTogether> axes;
    scatter_axes(std::span(scatters).first(waiting), axes);
    for (std::size_t i = 0; i < waiting; ++i) {
      planes[places[i]] = judged(neighbourhoods[places[i]], axes[i], config, radius);
    }
    waiting = 0;
  };
  for (std::size_t i = 0; i < neighbourhoods.size(); ++i) {
    if (neighbourhoods[i].count < config.min_plane_points) continue;
    scatters[waiting] = scatter_of(neighbourhoods[i]);
    places[waiting] = i;
    if (++waiting == kTogether) fit_waiting();
  }
  fit_waiting();
}

}  // namespace ignis
