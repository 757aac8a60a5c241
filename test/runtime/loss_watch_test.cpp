// SPDX-License-Identifier: Apache-2.0
#include "lio_frontend/loss_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace ignis {
namespace {

/// A channel of 250 messages a second of which a share is lost between two instants.
class Channel {
 public:
  void run(double seconds, int lost_of_hundred) {
    for (int i = 0; i < seconds * 250; ++i) {
      ++(number_++ % 100 < lost_of_hundred ? lost_ : heard_);
      now_s_ += 0.004;
      watch_.look(now_s_, heard_, lost_);
    }
  }
  [[nodiscard]] std::string trouble() const { return watch_.trouble(); }

 private:
  LossWatch watch_{"L1_IMU"};
  std::int64_t number_ = 0;
  std::int64_t heard_ = 0;
  std::int64_t lost_ = 0;
  double now_s_ = 1e6;
};

TEST(Fault_B1, AThirdLostIsTroubleWhileItGoesOnAndNoLonger) {
  Channel channel;
  channel.run(5.0, 0);
  EXPECT_EQ(channel.trouble(), "");
  channel.run(3.6, 30);
  EXPECT_NE(channel.trouble().find("L1_IMU"), std::string::npos) << channel.trouble();
  for (int second = 0; second < 20; ++second) {
    channel.run(1.0, 30);
    EXPECT_NE(channel.trouble(), "");
  }
  channel.run(6.0, 0);
  EXPECT_EQ(channel.trouble(), "");
}

TEST(LossWatch, TellsNothingOfATenth) {
  Channel channel;
  channel.run(20.0, 10);
  EXPECT_EQ(channel.trouble(), "");
}

/// Changes between trouble and none within ten minutes of a channel of 20 Hz that loses such a share at random, most of
/// it in bursts of three.
int changes(double share) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> draw;
  LossWatch watch("L1_SCAN");
  std::int64_t heard = 0;
  std::int64_t lost = 0;
  int changes = 0;
  int burst = 0;
  for (int i = 0; i < 600 * 20; ++i) {
    if (burst == 0 && draw(random) < share / 3.0) burst = 3;
    ++(burst > 0 ? lost : heard);
    burst = std::max(0, burst - 1);
    const bool was_trouble = !watch.trouble().empty();
    watch.look(0.05 * i, heard, lost);
    changes += was_trouble == watch.trouble().empty() ? 1 : 0;
  }
  return changes;
}

TEST(LossWatch, DoesNotComeAndGo) {
  EXPECT_EQ(changes(0.05), 0);
  EXPECT_LE(changes(0.10), 20);
  EXPECT_LE(changes(0.30), 3);
}

TEST(LossWatch, TakesAnotherSenderOrAJumpInALogForNoLoss) {
  LossWatch watch("L1_IMU");
  for (int i = 0; i < 40; ++i) watch.look(0.5 * i, 125L * i, i < 20 ? 0 : 100'000);
  EXPECT_EQ(watch.trouble(), "");
  for (int i = 40; i < 80; ++i) {
    watch.look(0.5 * i, 125L * i, 100'000L * i);
    EXPECT_EQ(watch.trouble(), "");
  }
}

TEST(LossWatch, TellsNothingOfAChannelThatIsSilent) {
  LossWatch watch("L1_SCAN");
  for (int second = 0; second < 10; ++second) {
    watch.look(second, 100, 3);
    EXPECT_EQ(watch.trouble(), "") << second;
  }
}

TEST(LossWatch, TellsNothingOfAFewOfASlowChannel) {
  LossWatch watch("L1_SCAN");
  for (int second = 0; second < 10; ++second) watch.look(second, 5L * second, second);
  EXPECT_EQ(watch.trouble(), "");
}

TEST(LossWatch, TellsNothingOfAHandfulThoughItIsAllThereWas) {
  LossWatch watch("L1_SCAN");
  watch.look(0.0, 0, 0);
  watch.look(1.0, 1, 4);
  EXPECT_EQ(watch.trouble(), "");
  watch.look(2.0, 1, 9);
  EXPECT_NE(watch.trouble(), "");
}

}  // namespace
}  // namespace ignis
