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

}  // namespace
}  // namespace ignis
