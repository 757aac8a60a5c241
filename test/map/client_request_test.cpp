// SPDX-License-Identifier: Apache-2.0
#include "map/view_request.h"

#include <gtest/gtest.h>

namespace ignis {
namespace {

constexpr double kMax = 150.0;

TEST(ViewRequest, ReadsARadius) { EXPECT_DOUBLE_EQ(parse_view_request(R"({"view": 25.5})", kMax).value(), 25.5); }

TEST(ViewRequest, ClampsWhatIsTooLargeOrTooSmall) {
  EXPECT_DOUBLE_EQ(parse_view_request(R"({"view": 1e300})", kMax).value(), kMax);
  EXPECT_DOUBLE_EQ(parse_view_request(R"({"view": -4})", kMax).value(), kMinViewRadius);
  EXPECT_DOUBLE_EQ(parse_view_request(R"({"view": 0})", kMax).value(), kMinViewRadius);
}

TEST(ViewRequest, RefusesEverythingElse) {
  const std::string deep(100, '[');
  for (const std::string& text :
       {std::string(), std::string("25"), std::string("{}"), std::string(R"({"view": "25"})"),
        std::string(R"({"view": null})"), std::string(R"({"view": NaN})"), std::string(R"({"view": 1e999})"),
        std::string(R"({"view": 1, "x": 2})"), std::string(R"({"view": 1, "view": 2})"),
        std::string(R"({"view": true})"), std::string(R"({"view": 25)"), std::string("{\"view\": \xff}"), deep,
        std::string(100'000, ' ')}) {
    const auto parsed = parse_view_request(text, kMax);
    EXPECT_FALSE(parsed.has_value()) << text.substr(0, 60);
    if (!parsed) {
      EXPECT_FALSE(parsed.error().empty());
    }
  }
}

}  // namespace
}  // namespace ignis
