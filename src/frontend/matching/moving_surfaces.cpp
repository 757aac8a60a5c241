// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/moving_surfaces.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace ignis {
namespace {

constexpr double kCell = 1.0;          // m
constexpr double kPatchSigma = 0.017;  // m: of a patch that stands; planes near edges are off by that much
constexpr double kPointSigma = 0.02;   // m: of a single point
constexpr double kRecent = 1.0;        // s: what was mapped since then is off by the velocity times its age at most
// A direction that a smaller share of the surfaces faces is one along which few can lead astray.
constexpr double kFewSurfaces = 0.2;
// Of these the share that stands still, and the number of patches that do not, when a scan is said to be of things that
// move. With a kPatchSigma of 0.012 m: in 0.1 to 0.5 % of the scans of an L1 in corridors and streets without traffic,
// in none where more is seen; in 6 to 16 % of those among people and trucks, with 64 beams in 50 to 98 %.
constexpr double kMostThatStands = 0.7;
constexpr int kPatchesThatMove = 2;
// Of what faces a direction that many do: where less of it lies where it is expected, the pose is off, and not the
// scene.
constexpr double kLeastThatFits = 0.9;
constexpr double kMemory = 2.0;       // s, in which such scans are forgotten
constexpr double kDoubtful = 0.5;     // such scans within the memory: patches that have moved are left out
constexpr double kRestless = 2.5;     // the same, for what is younger than kSettled to be left out as well
constexpr double kQuiet = 0.25;       // and for it to be believed again: 5 to 10 s later
constexpr double kSettled = 2.0;      // s: what moves leaves a trail behind that is younger, and has left what is older
constexpr double kKnownSpeed = 0.15;  // m/s, sigma: beyond, what walks by is not found out

/// The cell of a point, 20 bits for each coordinate, and the direction that it faces.
std::int64_t key_of(const Eigen::Vector3d& point, int axis) {
  std::int64_t key = axis;
  for (const double x : point) key = (key << 20) | (static_cast<std::int64_t>(std::floor(x / kCell)) & 0xFFFFF);
  return key;
}

}  // namespace

void MovingSurfaces::gather(std::span<const MatchedSurface> surfaces, const Eigen::Matrix3d& axes) {
  order_.clear();
  for (const MatchedSurface& surface : surfaces) {
    int axis = 0;
    (axes.transpose() * surface.normal).cwiseAbs().maxCoeff(&axis);
    order_.emplace_back(key_of(surface.point, axis), static_cast<std::uint32_t>(order_.size()));
  }
  std::ranges::sort(order_);
  patches_.clear();
  patch_of_.resize(surfaces.size());
  for (const auto& [key, i] : order_) {
    const int axis = static_cast<int>(key >> 60);
    if (patches_.empty() || patches_.back().key != key) patches_.push_back({.key = key, .axis = axis});
    const MatchedSurface& surface = surfaces[i];
    const double side = surface.normal.dot(axes.col(axis)) < 0.0 ? -surface.weight : surface.weight;
    Patch& patch = patches_.back();
    patch.normal += side * surface.normal;
    patch.distance += side * surface.distance;
    patch.age += surface.weight * surface.age_s;
    patch.weight += surface.weight;
    ++patch.count;
    patch_of_[i] = static_cast<std::uint32_t>(patches_.size() - 1);
  }
}

bool MovingSurfaces::is_off(const Patch& patch, const PriorMotion& prior) const {
  const double distance = patch.distance / patch.weight;
  const double age = patch.age / patch.weight;
  const Eigen::Vector3d normal = patch.normal.normalized();
  double of_the_pose = normal.dot(prior.position_covariance * normal);
  if (age < kRecent) of_the_pose = std::min(of_the_pose, age * age * normal.dot(prior.velocity_covariance * normal));
  const double variance = kPatchSigma * kPatchSigma + kPointSigma * kPointSigma / patch.count + of_the_pose;
  return distance * distance > sigmas_ * sigmas_ * variance;
}

void MovingSurfaces::sum_up(const PriorMotion& prior) {
  for (Patch& patch : patches_) {
    const bool is_off_its_place = is_off(patch, prior);
    patch.moved = is_off_its_place && patch.age < kSettled * patch.weight;
    if (patch.moved) ++directions_[static_cast<std::size_t>(patch.axis)].moving;
    for (Direction& direction : directions_) {
      const double facing = direction.axis.dot(patch.normal.normalized());
      const double share = patch.weight * facing * facing;
      direction.all += share;
      if (!patch.moved) direction.standing += share;
      if (!is_off_its_place) direction.fitting += share;
    }
  }
}

const std::vector<bool>& MovingSurfaces::judge(std::span<const MatchedSurface> surfaces, const PriorMotion& prior) {
  moved_.assign(surfaces.size(), false);
  if (sigmas_ <= 0.0 || surfaces.empty()) return moved_;
  Eigen::Matrix3d facing = Eigen::Matrix3d::Zero();
  for (const MatchedSurface& surface : surfaces) {
    facing += surface.weight * surface.normal * surface.normal.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(facing / facing.trace());
  for (int k = 0; k < 3; ++k) {
    directions_[static_cast<std::size_t>(k)] = {.axis = solver.eigenvectors().col(k),
                                                .is_faced_by_few = solver.eigenvalues()[k] < kFewSurfaces};
  }
  gather(surfaces, solver.eigenvectors());
  sum_up(prior);

  const bool pose_is_off = std::ranges::any_of(directions_, [](const Direction& direction) {
    return !direction.is_faced_by_few && direction.fitting < kLeastThatFits * direction.all;
  });
  const bool is_contested = std::ranges::any_of(directions_, [](const Direction& direction) {
    return direction.is_faced_by_few && direction.moving >= kPatchesThatMove &&
           direction.standing < kMostThatStands * direction.all;
  });
  const bool speed_is_known = std::ranges::none_of(directions_, [&](const Direction& direction) {
    const double variance = direction.axis.dot(prior.velocity_covariance * direction.axis);
    return direction.is_faced_by_few && variance > kKnownSpeed * kKnownSpeed;
  });
  if (speed_is_known) unrest_ *= std::exp(-prior.seconds / kMemory);
  if (is_contested && !pose_is_off && speed_is_known && prior.seconds > 0.0) unrest_ += 1.0;
  restless_ = unrest_ > (restless_ ? kQuiet : kRestless);
  if (unrest_ < kDoubtful || pose_is_off) return moved_;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Patch& patch = patches_[patch_of_[i]];
    const bool is_left_out = patch.moved || (restless_ && patch.age < kSettled * patch.weight);
    moved_[i] = is_left_out && directions_[static_cast<std::size_t>(patch.axis)].is_faced_by_few;
  }
  return moved_;
}

}  // namespace ignis
