// SPDX-License-Identifier: Apache-2.0
#include "drivers/driver_config.h"

#include <gtest/gtest.h>

#include "common/config_json.h"
#include "drivers/l1_decoder.h"

namespace ignis {
namespace {

TEST(DriverConfig, SurvivesPrintingAndLoading) {
  DriverConfig config;
  config.port = "/dev/pts/3";
  config.range_max_m = 12.5;
  config.own_structure.push_back({{-1, -1, -1}, {1, 1, 1}});
  const auto printed = config::Printer::print(config);
  EXPECT_EQ(config::Printer::print(config::load<DriverConfig>(printed)), printed);
}

TEST(DriverConfig, NamesEveryOffenceAtOnce) {
  DriverConfig config;
  config.baud = 1;
  config.packets_per_scan = 0;
  config.time_source = "sundial";
  config.range_min_m = 5.0;
  config.range_max_m = 4.0;
  config.own_structure.push_back({{0, 0, 0}, {1, 0, 1}});
  try {
    const l1::L1Decoder decoder(config, l1_extrinsics());
    FAIL() << "accepted";
  } catch (const config::ConfigError& error) {
    const std::string text = error.what();
    for (const char* part : {"driver.baud", "driver.packets_per_scan", "driver.time_source", "driver.range_max_m",
                             "driver.own_structure[0].max_m[1]"}) {
      EXPECT_NE(text.find(part), std::string::npos) << part << " in " << text;
    }
  }
}

TEST(DriverConfig, RefusesExtrinsicsOutOfRange) {
  Extrinsics extrinsics = l1_extrinsics();
  extrinsics.lidar.axes = "sideways";
  EXPECT_THROW(l1::L1Decoder(DriverConfig{}, extrinsics), config::ConfigError);
}

}  // namespace
}  // namespace ignis
