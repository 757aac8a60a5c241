// SPDX-License-Identifier: Apache-2.0
#include "map/map_config.h"

#include <gtest/gtest.h>

#include "common/config_check.h"
#include "map/three_level_map.h"

namespace ignis {
namespace {

TEST(MapConfig, DefaultsAreValid) { EXPECT_NO_THROW(config::require_valid(MapConfig{}, "map")); }

TEST(MapConfig, RefusesEveryOffenceInOneMessage) {
  MapConfig config;
  config.mid_cell_m = 0.3;
  config.mid_window_m = 5.0;
  config.max_voxels = 1;
  try {
    const ThreeLevelMap map(config);
    FAIL() << "a bad configuration was accepted";
  } catch (const config::ConfigError& error) {
    const std::string text = error.what();
    for (const char* name : {"map.mid_cell_m", "map.coarse_cell_m", "map.mid_window_m", "map.max_voxels"}) {
      EXPECT_NE(text.find(name), std::string::npos) << name << " is missing in: " << text;
    }
  }
}

TEST(MapConfig, RefusesWindowsThatSixteenBitsCannotIndex) {
  MapConfig config;
  config.local_cell_m = 0.01;
  config.local_window_m = 400.0;
  config.mid_window_m = 450.0;
  config.coarse_window_m = 500.0;
  EXPECT_THROW(config::require_valid(config, "map"), config::ConfigError);
}

}  // namespace
}  // namespace ignis
