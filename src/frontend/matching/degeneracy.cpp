// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/degeneracy.h"

#include <algorithm>
#include <cmath>
#include <format>

#include <Eigen/Eigenvalues>

namespace ignis {

namespace {

constexpr double kMostlyShift = 0.7;  // of a unit vector: beyond, it is more shift than turn
// Signal that a turn takes from a shift, as a share of what errors of the normals explain. Chance makes some 1 / points
// of it. Straight walls: at most 0.06; bends of 25 m radius: from 0.29, of 12 m 1.2, of 6 m 4.8
// (docs/results/blind_directions.md, What holds it together where geometry says nothing).
constexpr double kOwnTurn = 0.1;

/// Adds a direction to an orthonormal list.
void append_orthonormal(std::vector<Vector6d>& list, Vector6d direction) {
  for (const Vector6d& other : list) direction -= other * other.dot(direction);
  if (direction.norm() > 1e-6) list.push_back(direction.normalized());
}

/// What a scan says along a unit direction.
double signal(const Vector6d& direction, const Matrix6d& sensitivity) { return direction.dot(sensitivity * direction); }

/// The share of a direction's sensitivity that errors of the normals do not explain, as a weight of its information.
double weight_of(double value, double noise) {
  return value > 0.0 ? std::sqrt(std::max(1.0 - noise / value, 0.0)) : 0.0;
}

}  // namespace

bool is_mostly_shift(const Vector6d& direction) { return direction.tail<3>().norm() > kMostlyShift; }

Vector6d without_small_turn(const Vector6d& direction) {
  Vector6d pure = direction;
  if (is_mostly_shift(direction)) pure.head<3>().setZero();
  return pure;
}

ScaledSensitivity::ScaledSensitivity(const Matrix6d& sensitivity, const Matrix6d& normal_noise, double length)
    : length_m(length) {
  Vector6d inverse_scale = Vector6d::Ones();
  inverse_scale.head<3>().setConstant(1.0 / length);
  value = inverse_scale.asDiagonal() * sensitivity * inverse_scale.asDiagonal();
  noise = inverse_scale.asDiagonal() * normal_noise * inverse_scale.asDiagonal();
}

std::array<bool, 6> blind_among(const Matrix6d& basis, const ScaledSensitivity& scan,
                                const std::array<double, 6>& needed, const DegeneracyLimits& limits) {
  const double least_of_shift = std::max(limits.min_sensitivity, limits.min_shift_sensitivity);
  std::array<bool, 6> blind{};
  for (std::size_t i = 0; i < 6; ++i) {
    const Vector6d direction = basis.col(static_cast<Eigen::Index>(i));
    const double value = signal(direction, scan.value);
    const double least = is_mostly_shift(direction) ? least_of_shift : limits.min_sensitivity;
    blind[i] = value < least || value < needed[i] * signal(direction, scan.noise);
  }
  return blind;
}

std::array<bool, 6> turning_among(const Matrix6d& basis, const std::array<bool, 6>& blind,
                                  const ScaledSensitivity& scan) {
  Matrix6d on_blind = Matrix6d::Zero();
  for (std::size_t i = 0; i < 6; ++i) {
    const Vector6d direction = basis.col(static_cast<Eigen::Index>(i));
    if (blind[i]) on_blind += direction * direction.transpose();
  }
  std::array<bool, 6> turning{};
  for (std::size_t i = 0; i < 6; ++i) {
    const Vector6d direction = basis.col(static_cast<Eigen::Index>(i));
    if (!blind[i] || !is_mostly_shift(direction)) continue;
    const Vector6d shift = without_small_turn(direction).normalized();
    const Vector6d nearest = (on_blind * shift).normalized();
    turning[i] = signal(shift, scan.value) - signal(nearest, scan.value) > kOwnTurn * signal(shift, scan.noise);
  }
  return turning;
}

DegeneracyAnalysis without_blind(const Matrix6d& basis, const ScaledSensitivity& scan, const std::array<bool, 6>& blind,
                                 const std::array<bool, 6>& turning, double min_sensitivity) {
  DegeneracyAnalysis analysis;
  analysis.length_m = scan.length_m;
  Matrix6d observed = Matrix6d::Zero();
  for (std::size_t i = 0; i < 6; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const Vector6d direction = basis.col(k);
    const double value = signal(direction, scan.value);
    const double noise = signal(direction, scan.noise);
    analysis.eigenvalues[k] = value;
    analysis.noise[k] = noise;
    if (blind[i]) {
      append_orthonormal(analysis.degenerate, turning[i] ? direction : without_small_turn(direction));
    } else {
      observed += weight_of(value, noise) * direction * direction.transpose();
    }
  }
  analysis.degenerate_directions = static_cast<int>(analysis.degenerate.size());

  Matrix6d rest = Matrix6d::Identity();
  Matrix6d doubtful = Matrix6d::Zero();
  for (const Vector6d& direction : analysis.degenerate) {
    rest -= direction * direction.transpose();
    const double value = signal(direction, scan.value);
    if (value < min_sensitivity) continue;
    doubtful += weight_of(value, signal(direction, scan.noise)) * direction * direction.transpose();
  }
  observed = (rest * observed * rest).eval();

  Vector6d scale = Vector6d::Ones();
  scale.head<3>().setConstant(scan.length_m);
  const Vector6d inverse_scale = scale.cwiseInverse();
  analysis.doubtful = inverse_scale.asDiagonal() * doubtful * scale.asDiagonal();
  analysis.blind_part = inverse_scale.asDiagonal() * (Matrix6d::Identity() - rest) * scale.asDiagonal();
  analysis.projector = inverse_scale.asDiagonal() * observed * scale.asDiagonal();
  return analysis;
}

DegeneracyAnalysis analyse_degeneracy(const Matrix6d& sensitivity, const Matrix6d& noise,
                                      const DegeneracyLimits& limits) {
  const ScaledSensitivity scan(sensitivity, noise, limits.length_m);
  std::array<double, 6> needed;
  needed.fill(limits.min_signal_to_noise);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(scan.value);
  const std::array<bool, 6> blind = blind_among(solver.eigenvectors(), scan, needed, limits);
  // A single scan is too little to tell a bend from chance.
  return without_blind(solver.eigenvectors(), scan, blind, {}, limits.min_sensitivity);
}

std::vector<Eigen::Vector3d> blind_shifts(const DegeneracyAnalysis& analysis) {
  std::vector<Eigen::Vector3d> axes;
  for (const Vector6d& direction : analysis.degenerate) {
    const Eigen::Vector3d shift = direction.tail<3>();
    if (shift.norm() > kMostlyShift) axes.push_back(shift.normalized());
  }
  return axes;
}

void blind_shifts_of_point(const DegeneracyAnalysis& analysis, const Eigen::Matrix3d& R,
                           const Eigen::Vector3d& point_body, std::vector<Eigen::Vector3d>& axes) {
  axes.clear();
  for (const Vector6d& direction : analysis.degenerate) {
    const Eigen::Vector3d shift = direction.tail<3>();
    if (shift.norm() <= kMostlyShift) continue;
    const Eigen::Vector3d turn = direction.head<3>() / analysis.length_m;
    axes.push_back((shift + R * turn.cross(point_body)).normalized());
  }
}

DegeneracyAnalysis without_known_shifts(DegeneracyAnalysis analysis, const Eigen::Matrix3d& information,
                                        double sigma_m) {
  std::erase_if(analysis.degenerate, [&](const Vector6d& direction) {
    const Eigen::Vector3d shift = direction.tail<3>();
    return shift.norm() > kMostlyShift && shift.dot(information * shift) * sigma_m * sigma_m > shift.squaredNorm();
  });
  analysis.degenerate_directions = static_cast<int>(analysis.degenerate.size());
  return analysis;
}

Eigen::Matrix3d tilt_of_blind_shifts(const DegeneracyAnalysis& analysis, const Eigen::Matrix3d& position_covariance) {
  // [rad] What sixty drives of a bare corridor were off across it, rms, over what they were off along it.
  constexpr double kTilt = 0.003;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& axis : blind_shifts(analysis)) {
    const double along = axis.dot(position_covariance * axis);
    sum += kTilt * kTilt * along * (Eigen::Matrix3d::Identity() - axis * axis.transpose());
  }
  return sum;
}

std::string describe(const DegeneracyAnalysis& analysis) {
  const auto text = [](const Eigen::Vector3d& axis) {
    return std::format("({:.2f}, {:.2f}, {:.2f})", axis.x(), axis.y(), axis.z());
  };
  std::string words;
  for (const Vector6d& direction : analysis.degenerate) {
    const bool shift = direction.tail<3>().norm() >= direction.head<3>().norm();
    Eigen::Vector3d axis = (shift ? direction.tail<3>() : direction.head<3>()).normalized();
    // A direction has no sign; the largest component is shown positive so that it reads the same in every scan.
    Eigen::Index largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    const double sign = axis[largest] < 0.0 ? -1.0 : 1.0;
    axis *= sign;
    if (!words.empty()) words += "; ";
    words += std::format("{} {}", shift ? "position along odom" : "turn about body", text(axis));
    const Eigen::Vector3d turn = sign * direction.head<3>() / analysis.length_m;
    if (!shift || turn.isZero(0.0)) continue;
    words += std::format(", turning {:.3f} rad/m about body {}", turn.norm() / direction.tail<3>().norm(),
                         text(turn.normalized()));
  }
  return words;
}

}  // namespace ignis
