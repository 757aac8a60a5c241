// SPDX-License-Identifier: Apache-2.0
#include "map/client_request.h"

#include <gtest/gtest.h>

namespace ignis {
namespace {

constexpr double kMax = 150.0;

double radius_of(const std::string& text) {
  return std::get<ViewRequest>(parse_client_request(text, kMax).value()).radius_m;
}

TEST(ClientRequest, ReadsARadius) { EXPECT_DOUBLE_EQ(radius_of(R"({"view": 25.5})"), 25.5); }

TEST(ClientRequest, ClampsARadiusThatIsTooLargeOrTooSmall) {
  EXPECT_DOUBLE_EQ(radius_of(R"({"view": 1e300})"), kMax);
  EXPECT_DOUBLE_EQ(radius_of(R"({"view": -4})"), kMinViewRadius);
  EXPECT_DOUBLE_EQ(radius_of(R"({"view": 0})"), kMinViewRadius);
}

TEST(ClientRequest, ReadsAResync) {
  EXPECT_TRUE(std::holds_alternative<ResyncRequest>(parse_client_request(R"({"resync": true})", kMax).value()));
}

TEST(ClientRequest, ReadsWhichLoopIsMeant) {
  const auto clouds =
      std::get<LoopCloudsRequest>(parse_client_request(R"({"loop": {"from": 12, "to": 3}})", kMax).value());
  EXPECT_EQ(clouds.from_id, 12);
  EXPECT_EQ(clouds.to_id, 3);
  const auto veto =
      std::get<LoopCommandRequest>(parse_client_request(R"({"veto": {"to": 3, "from": 12}})", kMax).value());
  EXPECT_TRUE(veto.veto);
  EXPECT_EQ(veto.from_id, 12);
  const auto withdraw = std::get<LoopCommandRequest>(
      parse_client_request(R"({"withdraw": {"from": 0, "to": 2147483647}})", kMax).value());
  EXPECT_FALSE(withdraw.veto);
  EXPECT_EQ(withdraw.to_id, 2147483647);
}

TEST(ClientRequest, RefusesEverythingElse) {
  const std::string deep(100, '[');
  for (const std::string& text : {std::string(),
                                  std::string("25"),
                                  std::string("{}"),
                                  std::string(R"({"view": "25"})"),
                                  std::string(R"({"view": null})"),
                                  std::string(R"({"view": NaN})"),
                                  std::string(R"({"view": 1e999})"),
                                  std::string(R"({"view": 1, "x": 2})"),
                                  std::string(R"({"view": 1, "view": 2})"),
                                  std::string(R"({"view": true})"),
                                  std::string(R"({"view": 25)"),
                                  std::string("{\"view\": \xff}"),
                                  deep,
                                  std::string(100'000, ' '),
                                  std::string(R"({"resync": false})"),
                                  std::string(R"({"resync": 1})"),
                                  std::string(R"({"loop": 3})"),
                                  std::string(R"({"loop": {"from": 1}})"),
                                  std::string(R"({"loop": {"from": 1, "to": -2}})"),
                                  std::string(R"({"loop": {"from": 1, "to": 2.5}})"),
                                  std::string(R"({"veto": {"from": 1, "to": 2, "x": 3}})"),
                                  std::string(R"({"veto": {"from": 1, "to": 2147483648}})"),
                                  std::string(R"({"withdraw": [1, 2]})"),
                                  std::string(R"({"shutdown": true})")}) {
    const auto parsed = parse_client_request(text, kMax);
    EXPECT_FALSE(parsed.has_value()) << text.substr(0, 60);
    if (!parsed) {
      EXPECT_FALSE(parsed.error().empty());
    }
  }
}

}  // namespace
}  // namespace ignis
