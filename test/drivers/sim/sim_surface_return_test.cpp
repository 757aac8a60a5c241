// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/surface_return.h"

#include <gtest/gtest.h>

namespace ignis::sim {
namespace {

TEST(VisibleRange, MeetsBothPointsOfTheDataSheet) {
  EXPECT_NEAR(visible_range(10.0, 20.0, 0.9), 20.0, 1e-9);
  EXPECT_NEAR(visible_range(10.0, 20.0, 0.1), 10.0, 1e-9);
  EXPECT_EQ(visible_range(10.0, 20.0, 0.0), 0.0);
}

TEST(GreyValue, SpansTheSensorsScale) {
  EXPECT_EQ(grey_value(0.0), 20);
  EXPECT_EQ(grey_value(1.0), 255);
  EXPECT_LT(grey_value(0.3), grey_value(0.6));
}

}  // namespace
}  // namespace ignis::sim
