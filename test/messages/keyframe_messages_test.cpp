// SPDX-License-Identifier: Apache-2.0
#include "messages/keyframe_messages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "common/so3.h"

namespace ignis::messages {
namespace {

Keyframe keyframe_of(int samples, int points, float reach) {
  Keyframe keyframe;
  keyframe.id = 12;
  keyframe.session = 2;
  keyframe.state.utime = 9'000'000;
  keyframe.state.T_odom_body = {so3::exp({0.1, 0.2, 0.3}), {1.0, 2.0, 3.0}};
  keyframe.state.v_odom = {0.5, 0.0, -1.0};
  keyframe.covariance = Matrix15d::Random();
  keyframe.scan_information = Matrix6d::Random();
  keyframe.sighted = SightedSpeed{.axis = {0.6, 0.0, -0.8}, .speed = 1.5, .variance = 0.0025};
  keyframe.previous_utime = 4'000'000;
  keyframe.stationary = true;
  for (int i = 0; i < samples; ++i) {
    keyframe.imu.push_back({.utime = 4'000'000 + 4'000 * i, .gyro = {0.01 * i, 0, 0}, .accel = {0, 9.81, 0}});
  }
  for (int i = 0; i < points; ++i) {
    const float ratio = static_cast<float>(i) / static_cast<float>(points);
    keyframe.cloud.push_back({.position = {ratio * reach, -ratio, reach}, .intensity = 200.0F});
  }
  return keyframe;
}

TEST(KeyframeMessages, ComeTogetherAgainWithinTheirResolution) {
  const Keyframe keyframe = keyframe_of(1250, 9000, 15.0F);
  KeyframeAssembler assembler;
  std::optional<Keyframe> back;
  for (const keyframe_t& part : to_messages(keyframe)) {
    EXPECT_LE(part.getEncodedSize(), 64'000);
    back = assembler.add(part);
  }
  ASSERT_TRUE(back);
  EXPECT_EQ(back->id, 12);
  EXPECT_EQ(back->session, 2);
  EXPECT_EQ(back->state.utime, keyframe.state.utime);
  EXPECT_EQ(back->previous_utime, keyframe.previous_utime);
  EXPECT_TRUE(back->stationary);
  EXPECT_TRUE(back->imu_complete);
  EXPECT_EQ(back->covariance, keyframe.covariance);
  EXPECT_EQ(back->scan_information, keyframe.scan_information);
  ASSERT_TRUE(back->sighted);
  EXPECT_EQ(back->sighted->axis, keyframe.sighted->axis);
  EXPECT_EQ(back->sighted->speed, 1.5);
  EXPECT_NEAR(back->sighted->variance, 0.0025, 1e-12);
  EXPECT_EQ(body_difference(back->state.T_odom_body, keyframe.state.T_odom_body).norm(), 0.0);
  ASSERT_EQ(back->imu.size(), keyframe.imu.size());
  EXPECT_EQ(back->imu[700].utime, keyframe.imu[700].utime);
  EXPECT_NEAR(back->imu[700].gyro.x(), keyframe.imu[700].gyro.x(), 1e-6);
  ASSERT_EQ(back->cloud.size(), keyframe.cloud.size());
  for (std::size_t i = 0; i < keyframe.cloud.size(); ++i) {
    ASSERT_LT((back->cloud[i].position - keyframe.cloud[i].position).norm(), 0.001F);
  }
}

TEST(KeyframeMessages, TellThatNothingWasSighted) {
  Keyframe keyframe = keyframe_of(1, 1, 1.0F);
  keyframe.sighted.reset();
  KeyframeAssembler assembler;
  const std::optional<Keyframe> back = assembler.add(to_messages(keyframe).front());
  ASSERT_TRUE(back);
  EXPECT_FALSE(back->sighted);
}

TEST(KeyframeMessages, TakeNoSigmaThatIsNoneForOne) {
  keyframe_t message = to_messages(keyframe_of(1, 1, 1.0F)).front();
  message.sighted_sigma = -0.05;
  KeyframeAssembler assembler;
  const std::optional<Keyframe> back = assembler.add(message);
  ASSERT_TRUE(back && back->sighted);
  EXPECT_TRUE(std::isnan(back->sighted->variance)) << "so that whoever takes it can refuse it by name";
}

TEST(KeyframeMessages, CoarsenTheResolutionInsteadOfWrapping) {
  const Keyframe keyframe = keyframe_of(1, 100, 120.0F);
  KeyframeAssembler assembler;
  const std::optional<Keyframe> back = assembler.add(to_messages(keyframe).front());
  ASSERT_TRUE(back);
  for (std::size_t i = 0; i < keyframe.cloud.size(); ++i) {
    ASSERT_LT((back->cloud[i].position - keyframe.cloud[i].position).norm(), 0.004F);
  }
}

/// The parts of keyframes 0 to `count` - 1, two or more each, in any order.
std::vector<keyframe_t> mixed_parts(int count) {
  std::vector<keyframe_t> parts;
  for (int id = 0; id < count; ++id) {
    Keyframe keyframe = keyframe_of(10, 9000, 15.0F);
    keyframe.id = id;
    for (keyframe_t& part : to_messages(keyframe)) {
      part.sequence = id;
      parts.push_back(std::move(part));
    }
  }
  std::ranges::shuffle(parts, std::mt19937(5));
  return parts;
}

TEST(KeyframeMessages, ComeTogetherThoughTheirPartsOvertakeEachOther) {
  KeyframeAssembler assembler;
  std::set<std::int32_t> complete;
  for (const keyframe_t& part : mixed_parts(32)) {
    ASSERT_GT(part.part_count, 1);
    if (const auto keyframe = assembler.add(part)) {
      complete.insert(keyframe->id);
      EXPECT_EQ(keyframe->cloud.size(), 9000U);
    }
  }
  EXPECT_EQ(complete.size(), 32U);
  EXPECT_EQ(assembler.incomplete(), 0);
}

TEST(KeyframeMessages, ThatStayIncompleteAreGivenUpInTheOrderOfTheirNewestPart) {
  KeyframeAssembler assembler;
  std::vector<std::vector<keyframe_t>> all(40);
  for (keyframe_t& part : mixed_parts(40)) all[static_cast<std::size_t>(part.id)].push_back(std::move(part));
  for (const auto& parts : all) EXPECT_FALSE(assembler.add(parts.front()));
  EXPECT_EQ(assembler.incomplete(), 8);
  EXPECT_TRUE(assembler.add(all[8].back()));
  EXPECT_FALSE(assembler.add(all[7].back()));
  keyframe_t impossible = all[9].front();
  impossible.id = 100;
  impossible.part = impossible.part_count;
  EXPECT_FALSE(assembler.add(impossible));
  EXPECT_EQ(assembler.incomplete(), 9);
  EXPECT_TRUE(assembler.add(all[9].back()));
}

TEST(KeyframeMessages, PartsThatComeAgainBehindTheWholeAreRepeatsAndNoKeyframesThatWait) {
  KeyframeAssembler assembler;
  std::map<std::int32_t, std::vector<keyframe_t>> keyframes;
  for (keyframe_t& part : mixed_parts(41)) keyframes[part.id].push_back(std::move(part));
  const std::vector<keyframe_t> waiting = keyframes.extract(40).mapped();
  EXPECT_FALSE(assembler.add(waiting.front()));
  for (const auto& [id, parts] : keyframes) {
    for (const keyframe_t& part : parts) EXPECT_EQ(assembler.add(part).has_value(), part.part == parts.back().part);
    EXPECT_FALSE(assembler.add(parts.back())) << id;
  }
  EXPECT_EQ(assembler.repeated(), 40);
  EXPECT_TRUE(assembler.add(waiting.back())) << "repeats have not taken its place";
  EXPECT_EQ(assembler.incomplete(), 0);
}

TEST(KeyframeMessages, AreHandedOverAgainWhenAllOfTheirPartsComeAgain) {
  KeyframeAssembler assembler;
  const std::vector<keyframe_t> parts = to_messages(keyframe_of(10, 9000, 15.0F));
  for (int time = 0; time < 2; ++time) {
    EXPECT_FALSE(assembler.add(parts.front()));
    EXPECT_TRUE(assembler.add(parts.back())) << "a receiver that had no room asks for it again";
  }
  EXPECT_EQ(assembler.incomplete(), 0);
}

TEST(Fault_B5, KeyframesWithoutEndAreHeldInPart) {
  KeyframeAssembler assembler;
  const std::vector<keyframe_t> honest = to_messages(keyframe_of(10, 9000, 15.0F));
  keyframe_t endless;
  endless.part_count = kMostParts;
  std::size_t most = 0;
  for (endless.part = 0; endless.part < kMostParts - 1; ++endless.part) {
    for (endless.id = 100; endless.id < 108; ++endless.id) {
      EXPECT_FALSE(assembler.add(endless));
      most = std::max(most, assembler.parts_waiting());
    }
  }
  EXPECT_EQ(most, static_cast<std::size_t>(kMostParts));
  EXPECT_GT(assembler.incomplete(), 7);
  EXPECT_FALSE(assembler.add(honest.front()));
  EXPECT_TRUE(assembler.add(honest.back())) << "the sound one has its place among them";
}

TEST(KeyframeMessages, OfTwoSessionsAreNotMixed) {
  const std::vector<keyframe_t> parts = to_messages(keyframe_of(10, 9000, 15.0F));
  ASSERT_EQ(parts.size(), 2U);
  keyframe_t other = parts.back();
  ++other.session;
  KeyframeAssembler assembler;
  EXPECT_FALSE(assembler.add(parts.front()));
  EXPECT_FALSE(assembler.add(other));
  EXPECT_TRUE(assembler.add(parts.back()));
}

}  // namespace
}  // namespace ignis::messages
