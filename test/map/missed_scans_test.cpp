// SPDX-License-Identifier: Apache-2.0
#include "map_builder/missed_scans.h"

#include <format>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace ignis {
namespace {

constexpr Utime kPeriod = 50'000;  // [us]

messages::PosedCloud cloud(std::int32_t number, std::size_t points = 3) {
  messages::PosedCloud made;
  made.sequence = number;
  made.utime = number * kPeriod;
  made.points.resize(points);
  return made;
}

/// Made of the scan with this number.
Keyframe keyframe_of(std::int32_t number, std::int32_t id) {
  Keyframe made;
  made.id = id;
  made.state.utime = number * kPeriod;
  return made;
}

/// "7 8 k2 9": clouds by number, keyframes by id.
std::string text(const std::vector<MapInput>& inputs) {
  std::string all;
  for (const MapInput& input : inputs) {
    if (!all.empty()) all += ' ';
    const auto* cloud = std::get_if<messages::PosedCloud>(&input);
    all += cloud != nullptr ? std::to_string(cloud->sequence) : std::format("k{}", std::get<Keyframe>(input).id);
  }
  return all;
}

TEST(MissedScans, HoldsNothingBackWhereNobodyHasBegun) {
  MissedScans missed;
  missed.hold(cloud(3), 1.0);
  EXPECT_FALSE(missed.waiting());
  EXPECT_TRUE(missed.ask(1.0).empty());
  EXPECT_TRUE(missed.take(9.0).empty());
}

TEST(MissedScans, GoesOnInTheOrderOfTheDriveOnceTheGapIsClosed) {
  MissedScans missed;
  missed.begin(6, 9, 10.0);
  missed.hold(cloud(9), 10.0);
  EXPECT_EQ(missed.ask(10.0), (std::vector{8, 7, 6})) << "the newest one again: its keyframe may be missing";
  missed.hold(keyframe_of(10, 5));
  missed.hold(cloud(10), 10.01);
  missed.hold(keyframe_of(7, 4));
  missed.hold(cloud(7), 10.02);
  missed.hold(cloud(6), 10.03);
  EXPECT_EQ(text(missed.take(10.03)), "");
  missed.hold(cloud(8), 10.04);
  EXPECT_EQ(text(missed.take(10.05)), "7 k4 8 9 10 k5");
  EXPECT_FALSE(missed.waiting());
  EXPECT_EQ(missed.trouble(10.05), "");
}

TEST(MissedScans, AsksAgainForWhatIsLateAndAtOnceForTheRestOnceAllHasCome) {
  MissedScans missed;
  missed.begin(0, 41, 0.0);
  missed.hold(cloud(41), 0.0);
  const std::vector<std::int32_t> first = missed.ask(0.0);
  ASSERT_EQ(std::ssize(first), MissedScans::kPartsAtOnce);
  EXPECT_EQ(first.front(), 40);
  EXPECT_TRUE(missed.ask(0.29).empty());
  EXPECT_EQ(missed.ask(0.31), first);
  for (const std::int32_t number : first) missed.hold(cloud(number), 0.4);
  EXPECT_EQ(missed.ask(0.4).front(), 40 - MissedScans::kPartsAtOnce);
}

TEST(MissedScans, AsksForFewerCloudsOfManyPoints) {
  MissedScans missed;
  missed.begin(0, 41, 0.0);
  missed.hold(cloud(41, 6 * 2900), 0.0);
  EXPECT_EQ(std::ssize(missed.ask(0.0)), MissedScans::kPartsAtOnce / 6);
}

TEST(MissedScans, GivesUpWhatDoesNotComeAndSaysHowMuch) {
  MissedScans missed;
  missed.begin(2, 9, 0.0);
  missed.hold(cloud(9), 0.0);
  missed.hold(cloud(8), 1.0);
  missed.hold(cloud(10), 2.5);
  EXPECT_EQ(text(missed.take(2.9)), "") << "one came after 1 s; those that arrive of themselves are no progress";
  EXPECT_EQ(text(missed.take(3.1)), "8 9 10");
  EXPECT_EQ(missed.trouble(3.1), "5 scans of the map's restart are missing");
  EXPECT_EQ(missed.trouble(3.2 + MissedScans::kTold_s), "");
}

TEST(MissedScans, TheNewestOneIsNotMissingWhenItAloneDoesNotComeAgain) {
  MissedScans missed;
  missed.begin(8, 9, 0.0);
  missed.hold(cloud(9), 0.0);
  EXPECT_EQ(text(missed.take(2.1)), "9");
  EXPECT_EQ(missed.trouble(2.1), "");
}

TEST(MissedScans, ARestartedFrontEndHasNothingToAskFor) {
  MissedScans missed;
  missed.begin(500, 3, 0.0);
  EXPECT_FALSE(missed.waiting());
  EXPECT_EQ(missed.trouble(0.0), "scans that a restarted front end no longer has of the map's restart are missing");
}

TEST(MissedScans, SaysWhatItWaitsForWhileNothingEntersTheMap) {
  MissedScans missed;
  missed.begin(6, 9, 0.0);
  missed.hold(cloud(9), 0.0);
  EXPECT_EQ(missed.trouble(0.0), "waiting for 3 scans of the map's restart");
  missed.hold(cloud(7), 0.1);
  missed.hold(cloud(6), 0.1);
  EXPECT_EQ(missed.trouble(0.1), "waiting for 1 scans of the map's restart");
  missed.hold(cloud(8), 0.2);
  ASSERT_EQ(text(missed.take(0.2)), "7 8 9");
  EXPECT_EQ(missed.trouble(0.2), "");
}

TEST(MissedScans, AFrontEndThatRestartsMeanwhileEndsTheWaitAndLosesNothingOfItsOwn) {
  MissedScans missed;
  missed.begin(6, 9, 0.0);
  missed.hold(cloud(9), 0.0);
  EXPECT_EQ(text(missed.take(0.5)), "");
  missed.hold(cloud(0), 0.5);
  EXPECT_EQ(text(missed.take(0.5)), "9 0") << "it counts anew, and comes after all others";
  EXPECT_FALSE(missed.waiting());
  EXPECT_EQ(missed.trouble(0.5), "2 scans of the map's restart are missing");
}

TEST(MissedScans, HoldsABoundedNumberOfPoints) {
  MissedScans missed;
  missed.begin(0, 5, 0.0);
  missed.hold(cloud(5, MissedScans::kMostPoints), 0.0);
  EXPECT_EQ(text(missed.take(0.0)), "");
  missed.hold(cloud(6), 0.0);
  EXPECT_EQ(text(missed.take(0.0)), "5 6");
  EXPECT_EQ(missed.trouble(0.0), "4 scans of the map's restart are missing");
}

TEST(MissedScans, SurvivesAnyNumber) {
  constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
  MissedScans missed;
  missed.begin(0, kMost, 0.0);
  missed.hold(cloud(kMost), 0.0);
  EXPECT_EQ(missed.ask(0.0).front(), kMost - 1);
  EXPECT_EQ(std::ssize(missed.take(2.1)), 1);
  EXPECT_EQ(missed.trouble(2.1), "2147483646 scans of the map's restart are missing");
  missed.begin(std::numeric_limits<std::int32_t>::min(), 1, 0.0);
  missed.hold(cloud(1), 0.0);
  EXPECT_FALSE(missed.ask(0.0).empty());
}

TEST(MissedScans, AnyOrderOfArrivalGivesTheOrderOfTheDrive) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 generator(seed);
    std::vector<MapInput> arrivals;
    for (std::int32_t number = 10; number < 40; ++number) {
      arrivals.emplace_back(cloud(number));
      if (number % 7 == 0) arrivals.emplace_back(keyframe_of(number, number / 7));
    }
    std::ranges::shuffle(arrivals, generator);
    MissedScans missed;
    missed.begin(10, 39, 0.0);
    for (const MapInput& input : arrivals) {
      if (const auto* cloud = std::get_if<messages::PosedCloud>(&input)) missed.hold(*cloud, 0.0);
      if (const auto* keyframe = std::get_if<Keyframe>(&input)) missed.hold(*keyframe);
    }
    const std::vector<MapInput> inputs = missed.take(0.0);
    EXPECT_EQ(text(inputs),
              "11 12 13 14 k2 15 16 17 18 19 20 21 k3 22 23 24 25 26 27 28 k4 29 30 31 32 33 34 35 k5 36 37 38 39")
        << "seed " << seed;
  }
}

}  // namespace
}  // namespace ignis
