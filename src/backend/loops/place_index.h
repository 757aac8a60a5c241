// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

namespace ignis {

/// Which places lie near a position, by a hash grid over the horizontal plane (X and Z). Asking costs what lies in the
/// cells around, however long the drive. Places are numbered 0, 1, 2 ...; one that moves is put into its new cell.
class PlaceIndex {
 public:
  /// `cell_m` should be about the radius that is asked for.
  explicit PlaceIndex(double cell_m) : cell_m_(cell_m) {}

  /// Puts a place where it is now; a new one must have the number size().
  void place(std::size_t number, const Eigen::Vector3d& position);

  /// Ascending numbers of all places in the cells within `radius_m`: every one within the radius, and some farther.
  [[nodiscard]] std::vector<std::size_t> around(const Eigen::Vector3d& position, double radius_m) const;

  [[nodiscard]] std::size_t size() const { return cell_of_.size(); }

 private:
  using Cell = std::uint64_t;
  [[nodiscard]] std::int64_t line(double coordinate) const;
  [[nodiscard]] static Cell cell(std::int64_t x, std::int64_t z);

  double cell_m_;
  std::vector<Cell> cell_of_;
  std::unordered_map<Cell, std::vector<std::size_t>> cells_;
};

}  // namespace ignis
