// SPDX-License-Identifier: Apache-2.0
#include "graph_backend/command_check.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace ignis {
namespace {

constexpr std::int32_t kSmallest = std::numeric_limits<std::int32_t>::min();

graph_command_t command(std::int8_t kind, std::int32_t from_id, std::int32_t to_id) {
  graph_command_t made{};
  made.command = kind;
  made.from_id = from_id;
  made.to_id = to_id;
  return made;
}

TEST(CommandCheck, KnowsTheCommandsOfTheMessageAndNoOthers) {
  for (int kind = -128; kind < 128; ++kind) {
    const bool is_one = kind == graph_command_t::WITHDRAW_LOOP || kind == graph_command_t::VETO_LOOP ||
                        kind == graph_command_t::SEND_FULL_SET;
    EXPECT_EQ(is_known(command(static_cast<std::int8_t>(kind), 0, 0)), is_one) << kind;
  }
}

TEST(CommandCheck, WantsTwoKeyframesThatTheGraphHolds) {
  std::vector<KeyframePose> keyframes(3);
  for (std::size_t i = 0; i < keyframes.size(); ++i) keyframes[i].id = static_cast<std::int32_t>(4 * i);
  const auto fits = [&](std::int32_t from_id, std::int32_t to_id) {
    return names_keyframes_of(keyframes, command(graph_command_t::VETO_LOOP, from_id, to_id));
  };
  EXPECT_TRUE(fits(8, 0));
  EXPECT_TRUE(fits(0, 4));
  EXPECT_FALSE(fits(8, 1));
  EXPECT_FALSE(fits(9, 0));
  EXPECT_FALSE(fits(8, 8));
  EXPECT_FALSE(fits(kSmallest, 0));
  EXPECT_FALSE(fits(8, kSmallest));
}

}  // namespace
}  // namespace ignis
