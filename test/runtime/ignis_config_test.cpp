// SPDX-License-Identifier: Apache-2.0
#include "runtime/ignis_config.h"

#include <fstream>

#include <gtest/gtest.h>

namespace ignis::runtime {
namespace {

const std::filesystem::path kFolder = IGNIS_CONFIG_DIR;

std::string content(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(IgnisConfig, EveryShippedFileIsAccepted) {
  for (const char* name : {"ignis8.json", "ignis8_tuned.json", "kitti.json", "ouster.json", "spinning.json"}) {
    EXPECT_NO_THROW((void)load_config(kFolder / name)) << name;
  }
}

TEST(IgnisConfig, ShippedSchemaIsTheOneOfThisBuild) { EXPECT_EQ(content(kFolder / "schema.json"), print_schema()); }

TEST(IgnisConfig, VehicleFileHoldsTheReferencesDefaults) {
  const IgnisConfig shipped = load_config(kFolder / "ignis8.json");
  EXPECT_EQ(print_config(shipped), print_config(IgnisConfig{}));
}

TEST(IgnisConfig, HashDependsOnValuesAndNotOnLayout) {
  const auto hash_of = [](const std::string& text) {
    return config_hash(config::load<IgnisConfig>(config::parse_json(text, "test")));
  };
  EXPECT_EQ(hash_of("{}"), hash_of(R"({ "frontend": {"voxel_size_m": 0.2} })"));
  EXPECT_NE(hash_of("{}"), hash_of(R"({"frontend": {"voxel_size_m": 0.25}})"));
}

TEST(IgnisConfig, FilterAndLoopGatesShareOneSectionAndAreCheckedTogether) {
  try {
    (void)config::load<IgnisConfig>(config::parse_json(
        R"({"frontend": {"loop_radius_m": -1, "max_range_m": 0.1}, "map": {"mid_cell_m": 0.3}})", "t"));
    FAIL() << "no error";
  } catch (const config::ConfigError& error) {
    for (const char* part : {"frontend.loop_radius_m", "frontend.max_range_m", "map.mid_cell_m"}) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << part;
    }
  }
}

}  // namespace
}  // namespace ignis::runtime
