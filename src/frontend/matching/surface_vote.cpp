// SPDX-License-Identifier: Apache-2.0
//
// Which of the surfaces that a scan was matched with have a vote: what moves, or may, has none, and what is rough has
// less of one.
#include <algorithm>
#include <iterator>
#include <vector>

#include "common/plane_smoothness.h"
#include "frontend/matching/scan_matcher.h"
#include "frontend/planes/rough_planes.h"

namespace ignis {
namespace {

// Map points that are younger than this on average, half a second of L1 scans, may be those of something that moves: it
// was elsewhere before. Looked for among 6, 10 and 14.
constexpr double kScansOfANewSurface = 10.0;
constexpr double kLeastSettledShare = 0.3;  // of a scan's planes: below, the place is new and not what is in it

}  // namespace

void ScanMatcher::leave_out_moving_surfaces(int newest_scan) {
  const Eigen::Matrix3d R = T_odom_predicted_.rotation.toRotationMatrix();
  const Eigen::Vector3d& t = T_odom_predicted_.translation;
  surfaces_.clear();
  for (const Constraint& constraint : constraints_) {
    const double scans = std::max(newest_scan + 1.0 - constraint.plane.mean_scan, 1.0);
    surfaces_.push_back({.point = R * constraint.point_body + t,
                         .normal = constraint.plane.normal,
                         .distance = residual(R, t, constraint),
                         .age_s = scans * scan_seconds_,
                         .weight = constraint.smoothness});
  }
  const std::vector<bool>& moved = moving_surfaces_.judge(surfaces_, prior_);
  prior_.seconds = 0.0;
  std::size_t i = 0;
  std::erase_if(constraints_, [&](const Constraint&) { return moved[i++]; });
}

void ScanMatcher::leave_out_new_surfaces(int newest_scan) {
  if (!speed_is_known_) return;
  const auto is_new = [&](const Constraint& constraint) {
    return constraint.plane.mean_scan > newest_scan - kScansOfANewSurface;
  };
  const auto settled = std::ssize(constraints_) - std::ranges::count_if(constraints_, is_new);
  const double needed =
      std::max(kLeastSettledShare * static_cast<double>(constraints_.size()), static_cast<double>(config_.min_matches));
  if (static_cast<double>(settled) >= needed) std::erase_if(constraints_, is_new);
}

void ScanMatcher::weigh_rough_planes() {
  const auto strict = [this](const Constraint& constraint) {
    const double variance = unexplained_variance(constraint.plane, config_.range_noise_m);
    return strict_smoothness(plane_smoothness(variance, config_.smooth_plane_m));
  };
  SmoothSupport support;
  for (const Constraint& constraint : constraints_) support.add(constraint.plane.normal, strict(constraint));
  const double sufficiency = support.sufficiency(config_.enough_smooth_planes);
  for (Constraint& constraint : constraints_) {
    constraint.hearing += sufficiency * (strict(constraint) - constraint.hearing);
  }
}

}  // namespace ignis
