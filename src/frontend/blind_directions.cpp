// SPDX-License-Identifier: Apache-2.0
#include "frontend/blind_directions.h"

#include <algorithm>
#include <cmath>

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
  DegeneracyAnalysis analysis = analyse_degeneracy(sensitivity_, noise_, limits);
  if (settled && (analysis.degenerate_directions > 0 || held_scans_ > 0)) hold(sensitivity, limits, analysis);
  return analysis;
}

void BlindDirections::restart(double length_m) {
  held_length_ = length_m;
  held_sensitivity_ = sensitivity_;
  held_scans_ = kFirstHeldScans;
  blind_.fill(false);
  disagreeing_ = 0;
}

void BlindDirections::hold(const Matrix6d& sensitivity, const DegeneracyLimits& limits, DegeneracyAnalysis& analysis) {
  if (held_scans_ == 0 || disagreeing_ > kMostDisagreeing) restart(limits.length_m);
  Vector6d scale = Vector6d::Ones();
  scale.head<3>().setConstant(held_length_);
  const Vector6d inverse_scale = scale.cwiseInverse();
  const auto scaled = [&](const Matrix6d& matrix) -> Matrix6d {
    return inverse_scale.asDiagonal() * matrix * inverse_scale.asDiagonal();
  };
  if (held_scans_ < kMostHeldScans) {
    ++held_scans_;
    held_sensitivity_ += (sensitivity - held_sensitivity_) / held_scans_;
    held_basis_ = Eigen::SelfAdjointEigenSolver<Matrix6d>(scaled(held_sensitivity_)).eigenvectors();
  }
  const Matrix6d recent = scaled(sensitivity_);
  const Matrix6d recent_noise = scaled(noise_);
  const int found = analysis.degenerate_directions;
  analysis.degenerate.clear();
  Matrix6d observed = Matrix6d::Zero();
  for (std::size_t i = 0; i < 6; ++i) {
    const Vector6d direction = held_basis_.col(static_cast<Eigen::Index>(i));
    const double value = direction.dot(recent * direction);
    const double noise = direction.dot(recent_noise * direction);
    const double needed = limits.min_signal_to_noise * (blind_[i] ? kRelease : 1.0);
    blind_[i] = value < limits.min_sensitivity || value < needed * noise;
    if (blind_[i]) {
      analysis.degenerate.push_back(direction);
    } else {
      observed += std::sqrt(std::max(1.0 - noise / value, 0.0)) * direction * direction.transpose();
    }
  }
  analysis.degenerate_directions = static_cast<int>(analysis.degenerate.size());
  analysis.projector = inverse_scale.asDiagonal() * observed * scale.asDiagonal();
  disagreeing_ = found > analysis.degenerate_directions ? disagreeing_ + 1 : 0;
  if (analysis.degenerate_directions == 0 && found == 0) held_scans_ = 0;
}

}  // namespace ignis
