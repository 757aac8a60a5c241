// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "frontend/lio_runner.h"
#include "frontend/local_map/local_map.h"

namespace ignis::test {

/// A second and a half of scans of a world, the furnished hall unless told, from a standing sensor at the origin: 29 as
/// a map.
struct StandingSensor {
  FrontendConfig config = tuned_config();
  LocalMap map{config};
  std::vector<Eigen::Vector3f> newest;      ///< the next scan
  std::vector<Eigen::Vector3f> newest_two;  ///< and the last one of the map before it

  explicit StandingSensor(const World& world = furnished_hall()) {
    const Drive drive = simulate(world, straight_drive(10.0, 0.0), 2.0, Sensors{}, 3);
    for (std::size_t i = 0; i < 30; ++i) {
      newest.clear();
      for (const ScanPoint& point : drive.scans[i].points) newest.push_back(point.position);
      if (i < 29) map.insert(newest, Pose(), true);
      if (i >= 28) newest_two.insert(newest_two.end(), newest.begin(), newest.end());
    }
  }
};

/// A prediction that knows its pose so well [m, rad] and nothing else.
inline FilterState predicted_at(const Pose& pose, double position_sigma, double attitude_sigma) {
  FilterState filter;
  filter.nominal.T_odom_body = pose;
  filter.covariance.setIdentity();
  filter.covariance.diagonal().segment<3>(kAttitude).setConstant(attitude_sigma * attitude_sigma);
  filter.covariance.diagonal().segment<3>(kPosition).setConstant(position_sigma * position_sigma);
  return filter;
}

}  // namespace ignis::test
