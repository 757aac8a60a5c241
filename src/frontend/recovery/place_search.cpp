// SPDX-License-Identifier: Apache-2.0
#include "frontend/recovery/place_search.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

#include <Eigen/LU>

namespace ignis {
namespace {

constexpr double kCell = 0.2;   // m
constexpr double kApart = 0.5;  // m: nearer ones lead to the same place

using Cell = Eigen::Vector3i;

/// Which cells of a box hold points of the map. One beside such a cell counts for half: a wall at its border is met on
/// either side.
class Occupancy {
 public:
  static constexpr int kFull = 2;

  Occupancy(const LocalMap& map, const Eigen::Vector3d& lo, const Eigen::Vector3d& hi)
      : lo_(lo), size_(((hi - lo) / kCell).array().ceil().cast<int>() + 1) {
    cells_.resize(static_cast<std::size_t>(index_of({0, 0, size_.z()})));
    for (const Eigen::Vector3d& point : map.confirmed_near(lo, hi)) {
      const Cell cell = cell_of(point);
      if ((cell.array() < 1).any() || (cell.array() >= size_.array() - 1).any()) continue;
      for (int axis = 0; axis < 3; ++axis) {
        for (const int way : {-1, 1}) half_fill(index_of(cell + way * Cell::Unit(axis)));
      }
      at(index_of(cell)) = kFull;
    }
  }

  [[nodiscard]] Cell cell_of(const Eigen::Vector3d& point) const {
    return ((point - lo_) / kCell).array().floor().cast<int>();
  }
  /// Linear: that of a sum of cells is the sum of theirs.
  [[nodiscard]] std::ptrdiff_t index_of(const Cell& cell) const {
    const std::ptrdiff_t rows = cell.y() + static_cast<std::ptrdiff_t>(size_.y()) * cell.z();
    return cell.x() + size_.x() * rows;
  }
  [[nodiscard]] int filled(std::ptrdiff_t index) const { return cells_[static_cast<std::size_t>(index)]; }

 private:
  [[nodiscard]] std::uint8_t& at(std::ptrdiff_t index) { return cells_[static_cast<std::size_t>(index)]; }
  void half_fill(std::ptrdiff_t index) { at(index) = std::max<std::uint8_t>(at(index), 1); }

  Eigen::Vector3d lo_;
  Cell size_;
  std::vector<std::uint8_t> cells_;
};

struct Place {
  Eigen::Vector3d position;
  double log_likelihood;
};

/// Of those that are too near to a better one only that is kept.
std::vector<Eigen::Vector3d> best_of(std::vector<Place> places, std::size_t most) {
  std::ranges::sort(places, std::greater{}, &Place::log_likelihood);
  std::vector<Eigen::Vector3d> best;
  for (const Place& place : places) {
    if (best.size() == most) break;
    const auto near = [&](const Eigen::Vector3d& other) { return (other - place.position).norm() <= kApart; };
    if (std::ranges::none_of(best, near)) best.push_back(place.position);
  }
  return best;
}

}  // namespace

std::vector<Eigen::Vector3d> likely_places(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body,
                                           const LocalMap& map, std::size_t most) {
  const Pose& pose = predicted.nominal.T_odom_body;
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  const Eigen::Matrix3d P = predicted.covariance.block<3, 3>(kPosition, kPosition);
  const Eigen::Array3d farthest = (kPlaceSigmas * P.diagonal().cwiseSqrt()).cwiseMin(kFarthestPlace);
  const Cell reach = (farthest / kCell).ceil().cast<int>();

  std::vector<Eigen::Vector3d> points;
  Eigen::Vector3d lo = pose.translation;
  Eigen::Vector3d hi = pose.translation;
  for (const Eigen::Vector3f& point : points_body) {
    if (point.norm() > kFarthestSearchPoint) continue;
    points.emplace_back(R * point.cast<double>() + pose.translation);
    lo = lo.cwiseMin(points.back());
    hi = hi.cwiseMax(points.back());
  }
  if (points.empty()) return {};
  const Eigen::Vector3d margin = kCell * (reach.cast<double>().array() + 2.0);
  const Occupancy occupancy(map, lo - margin, hi + margin);
  std::vector<std::ptrdiff_t> indices;
  for (const Eigen::Vector3d& point : points) indices.push_back(occupancy.index_of(occupancy.cell_of(point)));

  // What lies half a cell beside the line of a thin prediction is meant by it, too.
  const Eigen::Matrix3d information = (P + kCell * kCell / 12.0 * Eigen::Matrix3d::Identity()).inverse();
  const double weight = kIndependentPoints / (Occupancy::kFull * static_cast<double>(points.size()));
  std::vector<Place> places;
  for (int z = -reach.z(); z <= reach.z(); ++z) {
    for (int y = -reach.y(); y <= reach.y(); ++y) {
      for (int x = -reach.x(); x <= reach.x(); ++x) {
        const Eigen::Vector3d shift = kCell * Eigen::Vector3d(x, y, z);
        const double sigmas2 = shift.dot(information * shift);
        if (!(sigmas2 <= kPlaceSigmas * kPlaceSigmas)) continue;
        const std::ptrdiff_t offset = occupancy.index_of({x, y, z});
        int filled = 0;
        for (const std::ptrdiff_t index : indices) filled += occupancy.filled(index + offset);
        places.push_back({pose.translation + shift, weight * filled - 0.5 * sigmas2});
      }
    }
  }
  return best_of(std::move(places), most);
}

}  // namespace ignis
