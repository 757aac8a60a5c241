// SPDX-License-Identifier: Apache-2.0
#include "lio_frontend/loss_watch.h"

#include <gtest/gtest.h>

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
  channel.run(2.0, 30);
  EXPECT_NE(channel.trouble().find("L1_IMU"), std::string::npos) << channel.trouble();
  for (int second = 0; second < 20; ++second) {
    channel.run(1.0, 30);
    EXPECT_NE(channel.trouble(), "");
  }
  channel.run(3.5, 0);
  EXPECT_EQ(channel.trouble(), "");
}

TEST(LossWatch, TellsNothingOfATenth) {
  Channel channel;
  channel.run(20.0, 10);
  EXPECT_EQ(channel.trouble(), "");
}

TEST(LossWatch, TellsNothingOfAChannelThatIsSilent) {
  LossWatch watch("L1_SCAN");
  for (int second = 0; second < 10; ++second) watch.look(second, 100, 3);
  EXPECT_EQ(watch.trouble(), "");
}

TEST(LossWatch, TellsNothingOfAFewOfASlowChannel) {
  LossWatch watch("L1_SCAN");
  for (int second = 0; second < 10; ++second) watch.look(second, 5L * second, second);
  EXPECT_EQ(watch.trouble(), "");
}

}  // namespace
}  // namespace ignis
