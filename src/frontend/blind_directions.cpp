// SPDX-License-Identifier: Apache-2.0
#include "frontend/blind_directions.h"

#include <Eigen/Eigenvalues>

namespace ignis {
namespace {

constexpr double kShareOfNewestScan = 0.1;
constexpr int kFirstHeldScans = 10;  // the running mean's own length
constexpr int kMostHeldScans = 40;   // two seconds
constexpr int kMostDisagreeing = 10;
constexpr double kRelease = 1.5;  // evidence that ends blindness, relative to what would have prevented it

}  // namespace

DegeneracyAnalysis BlindDirections::add_scan(const Matrix6d& sensitivity, const Matrix6d& noise, bool settled,
                                             const DegeneracyLimits& limits) {
  const double share = settled ? kShareOfNewestScan : 1.0;
  sensitivity_ += share * (sensitivity - sensitivity_);
  noise_ += share * (noise - noise_);
  DegeneracyAnalysis newest = analyse_degeneracy(sensitivity_, noise_, limits);
  if (!settled || (newest.degenerate_directions == 0 && held_scans_ == 0)) return newest;

  if (held_scans_ == 0 || disagreeing_ > kMostDisagreeing) restart(limits.length_m);
  const ScaledSensitivity recent(sensitivity_, noise_, held_length_);
  if (held_scans_ < kMostHeldScans) average_direction(sensitivity);
  std::array<double, 6> needed;
  for (std::size_t i = 0; i < 6; ++i) needed[i] = limits.min_signal_to_noise * (blind_[i] ? kRelease : 1.0);
  const DegeneracyAnalysis held = judge_directions(held_basis_, recent, needed, limits.min_sensitivity);
  blind_ = held.blind;
  disagreeing_ = newest.degenerate_directions > held.degenerate_directions ? disagreeing_ + 1 : 0;
  if (newest.degenerate_directions == 0 && held.degenerate_directions == 0) held_scans_ = 0;
  return held;
}

void BlindDirections::restart(double length_m) {
  held_length_ = length_m;
  held_sensitivity_ = sensitivity_;
  held_scans_ = kFirstHeldScans;
  blind_.fill(false);
  disagreeing_ = 0;
}

void BlindDirections::average_direction(const Matrix6d& sensitivity) {
  ++held_scans_;
  held_sensitivity_ += (sensitivity - held_sensitivity_) / held_scans_;
  const ScaledSensitivity mean(held_sensitivity_, noise_, held_length_);
  held_basis_ = Eigen::SelfAdjointEigenSolver<Matrix6d>(mean.value).eigenvectors();
}

}  // namespace ignis
