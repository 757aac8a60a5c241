// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <format>

#include "common/config_fields.h"

namespace ignis {

/// The three-level voxel map and its view. Levels, fine to coarse: local, mid, coarse. Each level has cubic cells on a
/// grid through the world's origin and a cylindrical window: horizontal (XZ) distance from the vehicle.
struct MapConfig {
  double local_cell_m = 0.125;
  double mid_cell_m = 0.25;
  double coarse_cell_m = 0.5;
  double local_window_m = 10.0;
  double mid_window_m = 30.0;
  double coarse_window_m = 100.0;
  double height_window_m = 5.0;
  double slide_step_m = 0.5;
  int max_voxels = 3'000'000;
  int max_keyframe_points = 6'000'000;
  double rebuild_shift_m = 0.005;
  double rebuild_turn_rad = 0.001;
  int reanchor_points = 300'000;
  bool carve_free_space = false;
  int carve_rays = 3;
  int carve_keyframes = 1;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("local_cell_m", self.local_cell_m, {0.01, 2.0}, "m", "cell of the local level");
    visit.number("mid_cell_m", self.mid_cell_m, {0.02, 8.0}, "m", "cell of the mid level, a multiple of the local one");
    visit.number("coarse_cell_m", self.coarse_cell_m, {0.04, 32.0}, "m",
                 "cell of the coarse level, a multiple of the mid one");
    visit.number("local_window_m", self.local_window_m, {1.0, 500.0}, "m", "radius of the local level");
    visit.number("mid_window_m", self.mid_window_m, {1.0, 1000.0}, "m", "radius of the mid level");
    visit.number("coarse_window_m", self.coarse_window_m, {1.0, 5000.0}, "m", "radius of the coarse level");
    visit.number("height_window_m", self.height_window_m, {0.5, 500.0}, "m",
                 "height above and below the vehicle that the map keeps");
    visit.number("slide_step_m", self.slide_step_m, {0.01, 50.0}, "m",
                 "grid of the windows' centre, which follows the vehicle");
    visit.integer("max_voxels", self.max_voxels, {10'000, 100'000'000}, "voxels",
                  "bound of all levels together; beyond it the finest level is left out");
    visit.integer("max_keyframe_points", self.max_keyframe_points, {10'000, 200'000'000}, "points",
                  "bound of the stored keyframe clouds; beyond it the farthest cloud is dropped");
    visit.number("rebuild_shift_m", self.rebuild_shift_m, {0.0, 10.0}, "m",
                 "keyframe correction up to which its voxels stay where they are");
    visit.number("rebuild_turn_rad", self.rebuild_turn_rad, {0.0, 1.0}, "rad",
                 "keyframe turn up to which its voxels stay where they are");
    visit.integer("reanchor_points", self.reanchor_points, {0, 100'000'000}, "points",
                  "a correction that would read more stored points than this is built aside");
    visit.flag("carve_free_space", self.carve_free_space,
               "leave out points in places that were later seen to be empty");
    visit.integer("carve_rays", self.carve_rays, {1, 1000}, "rays",
                  "rays of one keyframe's scans through a mid cell that make it empty for this keyframe");
    visit.integer("carve_keyframes", self.carve_keyframes, {1, 100}, "keyframes",
                  "keyframes that must find a mid cell empty before its points go");
  }

  /// Cells must nest (a voxel of one level lies in exactly one of the next), windows must grow, and the cell indices of
  /// a window must fit the 16-bit records of the stream.
  void check(config::Offences& offences, const std::string& path) const {
    const auto refuse = [&](const char* name, double value, std::string allowed) {
      offences.push_back({path.empty() ? name : path + '.' + name, std::format("{}", value), std::move(allowed)});
    };
    const auto nests = [](double fine, double coarse) {
      const double ratio = coarse / fine;
      return ratio >= 2.0 - 1e-9 && std::abs(ratio - std::round(ratio)) < 1e-6;
    };
    const char* const kNesting = "a whole multiple (2 or more) of the next finer cell";
    const double finest = std::max(local_cell_m, 1e-9);
    if (coarse_cell_m / finest > kMaxCellRatio + 0.5) refuse("coarse_cell_m", coarse_cell_m, "at most 16 local cells");
    if (!nests(local_cell_m, mid_cell_m)) refuse("mid_cell_m", mid_cell_m, kNesting);
    if (!nests(mid_cell_m, coarse_cell_m)) refuse("coarse_cell_m", coarse_cell_m, kNesting);
    if (!(mid_window_m > local_window_m)) refuse("mid_window_m", mid_window_m, "more than local_window_m");
    if (!(coarse_window_m > mid_window_m)) refuse("coarse_window_m", coarse_window_m, "more than mid_window_m");
    const auto fits = [&](double cell, double window) {
      return (std::max(window, height_window_m) + slide_step_m) / cell < kMaxRelativeIndex;
    };
    if (!fits(local_cell_m, local_window_m)) refuse("local_window_m", local_window_m, "below 32000 cells");
    if (!fits(mid_cell_m, mid_window_m)) refuse("mid_window_m", mid_window_m, "below 32000 cells");
    if (!fits(coarse_cell_m, coarse_window_m)) refuse("coarse_window_m", coarse_window_m, "below 32000 cells");
  }

  static constexpr double kMaxRelativeIndex = 32000.0;
  static constexpr double kMaxCellRatio = 16.0;  // tables over the cells of a tile stay small
};

}  // namespace ignis
