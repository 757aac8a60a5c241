// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "common/byte_codec.h"
#include "frontend/frontend_config.h"

namespace ignis {

/// A point of a scan where the prediction puts it, and the plane of the map that it was matched with. Odom axes.
struct MatchedSurface {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit
  double distance = 0.0;                             ///< [m] of the point from the plane, along the normal
  double age_s = 0.0;                                ///< since what the plane is made of was measured, mean
  double weight = 1.0;                               ///< relative, as in the update
};

/// What is known of the vehicle without the scan, odom axes.
struct PriorMotion {
  Eigen::Matrix3d position_covariance = Eigen::Matrix3d::Zero();  ///< [m^2]
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();  ///< [m^2/s^2]
  double seconds = 0.0;  ///< since the last scan; 0 for a scan that is judged once more, from elsewhere
};

/// Tells surfaces that have moved since they were mapped from those that stand, where it matters: along directions that
/// few surfaces face.
///
/// Among trucks or people, most of what faces along the way may move, and all of it may agree with itself. The velocity
/// that IMU and scans have made up to now tells: within a tenth of a second it is wrong by millimetres, while what
/// passes at 1 m/s is a decimetre from where it was. A metre of surface is judged at once, since a single point is too
/// noisy, and only what was mapped a moment ago: what is older is off because the map or the pose is, and so is a scene
/// in which directions that many face are off as well. (The innovation test of Y. Bar-Shalom, X.-R. Li, T. Kirubarajan,
/// "Estimation with applications to tracking and navigation", 5.4, for each patch.)
///
/// Not all of it is found out: what is slow, or drags a trail of earlier scans along, passes. So a scene in which
/// surfaces are found to move is restless, and nothing that few surfaces say is believed until it is quiet again. While
/// the velocity is not known, nothing is found, and that is no sign of quiet.
class MovingSurfaces {
 public:
  explicit MovingSurfaces(const FrontendConfig& config) : sigmas_(config.moving_surface_sigma) {}

  /// Takes in the surfaces of a scan. One entry for each; true where it has moved and is to be left out.
  const std::vector<bool>& judge(std::span<const MatchedSurface> surfaces, const PriorMotion& prior);

  /// True when along some direction that few surfaces face these have been found to move again and again.
  [[nodiscard]] bool is_restless() const { return restless_; }

 private:
  /// What lies in one cell and faces the same way.
  struct Patch {
    std::int64_t key = 0;
    int axis = 0;                                      ///< number of the direction that it faces
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< these four: weighted sums
    double distance = 0.0;
    double age = 0.0;
    double weight = 0.0;
    int count = 0;
    bool moved = false;
  };
  /// An eigen-direction of what the scan's surfaces face, and how much of that does what, by weight.
  struct Direction {
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    bool is_faced_by_few = false;
    double all = 0.0;
    double standing = 0.0;  ///< has not moved
    double fitting = 0.0;   ///< lies where it is expected
    int moving = 0;         ///< patches
  };

  void gather(std::span<const MatchedSurface> surfaces, const Eigen::Matrix3d& axes);
  void sum_up(const PriorMotion& prior);
  [[nodiscard]] bool is_off(const Patch& patch, const PriorMotion& prior) const;

  double sigmas_;
  std::vector<std::pair<std::int64_t, std::uint32_t>> order_;  ///< key and number of each surface, sorted
  std::vector<Patch> patches_;
  std::array<Direction, 3> directions_;
  std::vector<std::uint32_t> patch_of_;
  std::vector<bool> moved_;
  double unrest_ = 0.0;  ///< scans of the last seconds in which surfaces were found to move
  bool restless_ = false;

  friend void transfer(auto& io, FieldsOf<MovingSurfaces> auto& surfaces) {
    io.number(surfaces.unrest_);
    io.number(surfaces.restless_);
  }
};

}  // namespace ignis
