// SPDX-License-Identifier: Apache-2.0
#include "runtime/peer_watch.h"

#include <cmath>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace ignis::runtime {
namespace {

const PeerIdentity kSelf{.process = "lio_frontend", .pid = 10, .version = "1.0", .config_hash = "aa"};

PeerIdentity peer(const std::string& process, std::int32_t pid) {
  PeerIdentity other = kSelf;
  other.process = process;
  other.pid = pid;
  return other;
}

TEST(PeerWatch, IsContentWithEqualsAndWithItself) {
  PeerWatch watch(kSelf);
  for (int i = 0; i < 10; ++i) {
    watch.observe(kSelf, i, 0.0);
    watch.observe(peer("map_builder", 11), i, 0.0);
  }
  EXPECT_EQ(watch.trouble(9.0), "");
  EXPECT_FALSE(watch.needs_person(9.0));
}

TEST(PeerWatch, NamesWhoseConfigurationDiffers) {
  PeerWatch watch(kSelf);
  PeerIdentity other = peer("map_builder", 11);
  other.config_hash = "bb";
  watch.observe(other, 1.0, 0.0);
  EXPECT_EQ(watch.trouble(1.5), "configuration differs from that of map_builder (ours aa, its bb)");
  EXPECT_TRUE(watch.needs_person(1.5));
}

TEST(PeerWatch, NamesWhoseVersionDiffers) {
  PeerWatch watch(kSelf);
  PeerIdentity other = peer("l1_driver", 12);
  other.version = "0.9";
  watch.observe(other, 1.0, 0.0);
  EXPECT_EQ(watch.trouble(1.5), "version 1.0 differs from 0.9 of l1_driver");
}

TEST(PeerWatch, IsNotContradictedByAPeerThatSaysNothingAboutItself) {
  PeerWatch watch(kSelf);
  watch.observe({.process = "a_tool", .pid = 12, .version = "", .config_hash = ""}, 1.0, 0.0);
  EXPECT_EQ(watch.trouble(1.5), "");
}

TEST(PeerWatch, ForgetsWhoFellSilent) {
  PeerWatch watch(kSelf);
  PeerIdentity other = peer("map_builder", 11);
  other.config_hash = "bb";
  watch.observe(other, 1.0, 0.0);
  EXPECT_NE(watch.trouble(1.0 + PeerWatch::kForgetAfter_s), "");
  EXPECT_EQ(watch.trouble(1.1 + PeerWatch::kForgetAfter_s), "");
}

TEST(PeerWatch, FollowsAPeerThatWasStartedAnewWithOurConfiguration) {
  PeerWatch watch(kSelf);
  PeerIdentity other = peer("map_builder", 11);
  other.config_hash = "bb";
  watch.observe(other, 1.0, 0.0);
  watch.observe(peer("map_builder", 13), 2.0, 0.0);
  EXPECT_EQ(watch.trouble(1.1 + PeerWatch::kForgetAfter_s), "");
}

TEST(PeerWatch, BelievesInASecondInstanceOnlyWhenItGoesOn) {
  PeerWatch watch(kSelf);
  watch.observe(peer("lio_frontend", 9), 0.0, 0.0);  // the last word of a killed predecessor
  EXPECT_EQ(watch.trouble(0.1), "");
  watch.observe(peer("lio_frontend", 9), 1.0, 0.0);
  watch.observe(peer("lio_frontend", 9), 2.0, 0.0);
  EXPECT_EQ(watch.trouble(2.1), "a second lio_frontend is on the bus (process 9)");
}

TEST(Fault_B7, TwoInstancesOfAnotherProcessAreNamedOnceBothHaveGoneOn) {
  PeerWatch watch(kSelf);
  const std::string both = "two instances of l1_driver are on the bus (processes 7 and 8)";
  for (int i = 0; i < 3; ++i) {
    watch.observe(peer("l1_driver", 7), i, 0.0);
    watch.observe(peer("l1_driver", 8), i + 0.5, 0.0);
    EXPECT_EQ(watch.trouble(i + 0.6), i < 2 ? "" : both) << i;
  }
  EXPECT_TRUE(watch.needs_person(2.6));
  watch.observe(peer("l1_driver", 7), 4.4, 0.0);
  EXPECT_EQ(watch.trouble(5.4), both) << "the second one may only be late";
  EXPECT_EQ(watch.trouble(5.6), "");
}

TEST(Fault_B7, AllButTheOneThatHasLivedLongestAreLatecomers) {
  PeerWatch watch(kSelf);
  const std::map<int, double> uptime_s{{100, 20.0}, {200, 900.0}, {300, 5.0}};
  for (int i = 0; i < 4; ++i) {
    for (const auto& [pid, lived_s] : uptime_s) watch.observe(peer("l1_driver", pid), i, lived_s + i);
    watch.observe(peer("map_builder", 7), i, i);
    EXPECT_EQ(watch.latecomers(i + 0.1).empty(), i < 2) << i << ": not believed before both have gone on for a while";
  }
  EXPECT_EQ(watch.latecomers(3.1), (std::vector{peer("l1_driver", 100), peer("l1_driver", 300)}));
  EXPECT_TRUE(watch.latecomers(3.1 + PeerWatch::kForgetAfter_s).empty());
}

/// HEALTH of drivers, by process id when they were started and when they end, heard once a second from `from_s` on.
struct Lives {
  std::map<int, std::pair<double, double>> lives;

  void tell(PeerWatch& watch, double from_s, double to_s, const std::function<void(double)>& look) const {
    for (double now_s = from_s; now_s <= to_s; now_s += 0.5) {
      for (const auto& [pid, life] : lives) {
        const double lived_s = now_s - life.first;
        if (lived_s >= 0.0 && now_s < life.second) watch.observe(peer("l1_driver", pid), now_s, lived_s);
      }
      look(now_s);
    }
  }
};

TEST(Fault_B7, AVehicleWhoseDriverIsStartedAnewGoesOnWithItAndNotWithTheLatecomer) {
  PeerWatch watch(kSelf);
  // 100 is ours, 200 came later; 100 dies and is followed by 300 a tenth of a second later.
  const Lives drivers{{{100, {-60.0, 10.0}}, {200, {-5.0, 1e9}}, {300, {10.1, 1e9}}}};
  drivers.tell(watch, 0.0, 30.0, [&](double now_s) {
    if (now_s < 2.0) return;
    EXPECT_EQ(watch.latecomers(now_s), std::vector{peer("l1_driver", 200)}) << now_s;
  });
}

TEST(Fault_B7, ALatecomerThatIsAloneIsNone) {
  PeerWatch watch(kSelf);
  const Lives drivers{{{100, {-60.0, 10.0}}, {200, {-5.0, 1e9}}, {300, {20.0, 1e9}}}};
  drivers.tell(watch, 0.0, 40.0, [&](double now_s) {
    if (now_s > 13.0 && now_s < 21.0) {
      EXPECT_TRUE(watch.latecomers(now_s).empty()) << now_s;
    }
    if (now_s > 22.0) {
      EXPECT_EQ(watch.latecomers(now_s), std::vector{peer("l1_driver", 300)}) << now_s;
    }
  });
}

TEST(Fault_B7, OfTwoLatecomersTheOneThatHasLivedLongerGoesOnWhenTheRightOneIsGone) {
  PeerWatch watch(kSelf);
  const Lives drivers{{{100, {-60.0, 10.0}}, {200, {-5.0, 1e9}}, {300, {-9.0, 1e9}}}};
  drivers.tell(watch, 0.0, 30.0, [&](double now_s) {
    if (now_s > 2.0 && now_s < 10.0) {
      EXPECT_EQ(watch.latecomers(now_s), (std::vector{peer("l1_driver", 200), peer("l1_driver", 300)})) << now_s;
    }
    if (now_s > 13.5) {
      EXPECT_EQ(watch.latecomers(now_s), std::vector{peer("l1_driver", 200)}) << now_s;
    }
  });
}

TEST(Fault_B7, AnUptimeThatIsImpossibleSaysNothing) {
  EXPECT_TRUE(PeerWatch::is_possible(0.0));
  for (const double uptime_s : {std::nan(""), HUGE_VAL, -HUGE_VAL, -0.001}) {
    EXPECT_FALSE(PeerWatch::is_possible(uptime_s)) << uptime_s;
    PeerWatch watch(kSelf);
    for (int i = 0; i < 3; ++i) {
      watch.observe(peer("l1_driver", 8), i, i);
      watch.observe(peer("l1_driver", 7), i, uptime_s);
    }
    EXPECT_EQ(watch.trouble(2.1), "") << uptime_s;
  }
}

TEST(Fault_B7, TwoInstancesThatHaveTheSameProcessIdAreTwo) {
  PeerWatch watch(kSelf);
  PeerIdentity near = peer("l1_driver", 7);
  PeerIdentity far = near;
  near.sender = {.ip = 0x0A000001, .port = 4000};
  far.sender = {.ip = 0x0A000002, .port = 4000};
  for (int i = 0; i < 4; ++i) {
    watch.observe(near, i, 60.0 + i);
    watch.observe(far, i, 5.0 + i);
  }
  EXPECT_EQ(watch.trouble(3.1),
            "two instances of l1_driver are on the bus (processes 7 at 10.0.0.1:4000 and 10.0.0.2:4000)");
  EXPECT_EQ(watch.latecomers(3.1), std::vector{far});
}

TEST(Fault_B7, ASecondInstanceThatHasOurProcessIdIsNoneOfOurs) {
  PeerWatch watch(kSelf);
  PeerIdentity other = kSelf;
  other.sender = {.ip = 0x0A000002, .port = 4000};
  for (int i = 0; i < 3; ++i) watch.observe(other, i, i);
  EXPECT_EQ(watch.trouble(2.1), "a second lio_frontend is on the bus (process 10)");
}

TEST(Fault_B7, AThirdThatHasJustEndedDoesNotHideTheOtherTwo) {
  PeerWatch watch(kSelf);
  for (int i = 0; i < 4; ++i) {
    watch.observe(peer("l1_driver", 100), i, 0.0);
    watch.observe(peer("l1_driver", 200), i + 0.1, 0.0);
  }
  watch.observe(peer("l1_driver", 150), 3.2, 0.0);
  EXPECT_EQ(watch.trouble(3.3), "two instances of l1_driver are on the bus (processes 100 and 200)");
}

TEST(Fault_B7, OneThatIsStartedAnewAndToolsAreNoTwoInstances) {
  PeerWatch watch(kSelf);
  PeerIdentity tool = peer("ignis_record", 1);
  tool.config_hash.clear();
  for (int i = 0; i < 12; ++i) {
    watch.observe(peer("l1_driver", i < 6 ? 7 : 8), 0.5 * i, 0.0);
    tool.pid = i % 2;
    watch.observe(tool, 0.5 * i, 0.0);
    EXPECT_EQ(watch.trouble(0.5 * i + 0.1), "") << i;
  }
}

TEST(Fault_P7, AProcessThatIsStartedFiveTimesWithinAMinuteIsNamedUntilItStays) {
  PeerWatch watch(kSelf);
  for (int start = 0; start < 5; ++start) {
    EXPECT_EQ(watch.trouble(2.0 * start), "") << start;
    watch.observe(peer("map_builder", 100 + start), 2.0 * start, 0.0);
    watch.observe(peer("map_builder", 100 + start), 2.0 * start + 1.0, 0.0);
  }
  EXPECT_EQ(watch.trouble(9.1), "map_builder was started 5 times within 60 s");
  EXPECT_TRUE(watch.needs_person(9.1));
  watch.observe(peer("map_builder", 104), 60.1, 0.0);
  EXPECT_EQ(watch.trouble(60.1), "") << "the last one has stayed";
}

TEST(Fault_B6, AFloodOfInventedProcessesIsRememberedInPart) {
  PeerWatch watch(kSelf);
  PeerIdentity other = peer(std::string(60'000, 'x'), 0);
  other.config_hash = other.version = std::string(60'000, 'y');
  for (other.pid = 0; other.pid < 1000; ++other.pid) watch.observe(other, 1.0, 0.0);
  EXPECT_LT(watch.trouble(1.0).size(), 32 * 300U) << "it must fit into a message";
}

}  // namespace
}  // namespace ignis::runtime
