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

TEST(IgnisConfig, FilterAndGraphMustAgreeOnTheInertialUnit) {
  const auto load = [](const char* text) { return config::load<IgnisConfig>(config::parse_json(text, "t")); };
  try {
    (void)load(
        R"({"frontend": {"imu_noise_gyro": 0.004, "gravity_m": 9.8}, "backend": {"imu": {"accel_noise": 0.1}}})");
    FAIL() << "no error";
  } catch (const config::ConfigError& error) {
    for (const char* part : {"backend.imu.gyro_noise", "frontend.imu_noise_gyro, 0.004", "backend.imu.gravity",
                             "backend.imu.accel_noise", "frontend.imu_noise_accel, 0.06"}) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << part << " in " << error.what();
    }
  }
  EXPECT_NO_THROW((void)load(R"({"frontend": {"imu_noise_gyro": 0.004}, "backend": {"imu": {"gyro_noise": 0.004}}})"));
  EXPECT_NO_THROW((void)load(R"({"frontend": {"accel_bias_walk": 0.02}})"));
}

}  // namespace
}  // namespace ignis::runtime
