// SPDX-License-Identifier: Apache-2.0
#include "common/trajectory_file.h"

#include <fstream>

#include <gtest/gtest.h>

#include "common/so3.h"

namespace ignis {
namespace {

std::filesystem::path temporary(const std::string& name) { return std::filesystem::path(testing::TempDir()) / name; }

TEST(TrajectoryFile, ReadsBackWhatItWroteToTheMicrosecond) {
  const Trajectory written = {{1'700'000'000'000'001, {so3::exp({0.1, 0.2, 0.3}), {1.0, -2.5, 1e-6}}},
                              {1'700'000'000'050'999, {so3::exp({-1.0, 0.2, 0.3}), {3.0, 4.0, -5.0}}}};
  write_tum(temporary("a.tum"), written);
  const Trajectory read = read_tum(temporary("a.tum"));
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].utime, written[i].utime);
    EXPECT_LT(body_difference(read[i].T_world_body, written[i].T_world_body).norm(), 1e-8);
  }
}

TEST(TrajectoryFile, SkipsCommentsAndNamesTheBadLine) {
  std::ofstream(temporary("b.tum")) << "# t x y z qx qy qz qw\n0.5 1 2 3 0 0 0 1\n0.6 1 2 3 0 0\n";
  try {
    (void)read_tum(temporary("b.tum"));
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("b.tum:3"), std::string::npos) << error.what();
  }
}

TEST(TrajectoryFile, RefusesAMissingFile) {
  EXPECT_THROW((void)read_tum(temporary("no-such.tum")), std::runtime_error);
}

}  // namespace
}  // namespace ignis
