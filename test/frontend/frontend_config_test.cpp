// SPDX-License-Identifier: Apache-2.0
#include "frontend/frontend_config.h"

#include <gtest/gtest.h>

#include "frontend/lio.h"

namespace ignis {
namespace {

TEST(FrontendConfig, DefaultsAreValid) { EXPECT_NO_THROW(config::require_valid(FrontendConfig{}, "frontend")); }

TEST(FrontendConfig, NamesEveryOffenceInOneMessage) {
  FrontendConfig config;
  config.gravity_m = 1.0;
  config.min_range_m = 10.0;
  config.max_range_m = 5.0;
  config.start = "flying";
  config.match_radius_m = 0.1;
  try {
    const Lio lio(config);
    FAIL() << "accepted";
  } catch (const config::ConfigError& error) {
    const std::string message = error.what();
    for (const char* field : {"gravity_m", "max_range_m", "start", "match_radius_m"}) {
      EXPECT_NE(message.find(std::string("frontend.") + field), std::string::npos) << message;
    }
  }
}

TEST(FrontendConfig, RefusesAWiderNeighbourhoodThatIsNoneOrThatTheSearchDoesNotReach) {
  for (double FrontendConfig::* field : {&FrontendConfig::wide_match_radius_m, &FrontendConfig::line_match_radius_m}) {
    FrontendConfig config;
    for (const double accepted : {0.0, 2.0 * config.match_radius_m, 10.0 * config.voxel_size_m}) {
      config.*field = accepted;
      EXPECT_NO_THROW(config::require_valid(config, "frontend")) << accepted;
    }
    for (const double refused : {config.match_radius_m, 10.1 * config.voxel_size_m}) {
      config.*field = refused;
      EXPECT_THROW(config::require_valid(config, "frontend"), config::ConfigError) << refused;
    }
  }
}

}  // namespace
}  // namespace ignis
