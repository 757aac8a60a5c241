// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/pose.h"

namespace ignis {

/// Sum of w h h^T over many h, with weights w. It is symmetric, so only the upper half is added up, in blocks of two
/// rows: as many as a vector register holds.
class SquareSum {
 public:
  void add(const Vector6d& h) { add(h, h); }
  void add(const Vector6d& h, double weight) { add(h, weight * h); }

  [[nodiscard]] Matrix6d matrix() const { return upper_.selfadjointView<Eigen::Upper>(); }

 private:
  /// `weighted` is a multiple of h.
  void add(const Vector6d& h, const Vector6d& weighted) {
    upper_.topLeftCorner<2, 2>() += h.head<2>().lazyProduct(weighted.head<2>().transpose());
    upper_.block<4, 2>(0, 2) += h.head<4>().lazyProduct(weighted.segment<2>(2).transpose());
    upper_.rightCols<2>() += h.lazyProduct(weighted.tail<2>().transpose());
  }

  Matrix6d upper_ = Matrix6d::Zero();  ///< what stands below the diagonal means nothing
};

}  // namespace ignis
