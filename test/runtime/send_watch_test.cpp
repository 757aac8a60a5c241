// SPDX-License-Identifier: Apache-2.0
#include "runtime/send_watch.h"

#include <gtest/gtest.h>

namespace ignis::runtime {
namespace {

TEST(Fault_B7, AProcessWhoseHealthCannotBeSentIsMuteUntilItCanAndSaysBothOnce) {
  SendWatch watch;
  EXPECT_EQ(watch.health_sent(true, 1.0), "");
  EXPECT_FALSE(watch.is_mute());
  watch.look(1, 2.0);
  EXPECT_EQ(watch.health_sent(false, 2.0), "nothing can be sent to the bus");
  EXPECT_TRUE(watch.is_mute());
  watch.look(2, 2.2);
  EXPECT_EQ(watch.health_sent(false, 2.2), "") << "once is enough";
  EXPECT_EQ(watch.trouble(100.0), "nothing can be sent to the bus") << "as long as it lasts";
  EXPECT_EQ(watch.health_sent(true, 3.5), "nothing could be sent to the bus for 1.5 s: 2 messages so far");
  EXPECT_FALSE(watch.is_mute());
  EXPECT_EQ(watch.trouble(3.6), "nothing could be sent to the bus for 1.5 s: 2 messages so far");
  EXPECT_EQ(watch.trouble(2.3 + SendWatch::kTold_s), "");
}

TEST(Fault_B7, MessagesThatCouldNotBeSentAreToldForAWhile) {
  SendWatch watch;
  watch.look(0, 1.0);
  EXPECT_EQ(watch.trouble(1.0), "");
  watch.look(3, 2.0);
  EXPECT_EQ(watch.trouble(2.0), "3 messages could not be sent so far");
  watch.look(3, 4.0);
  EXPECT_NE(watch.trouble(2.0 + SendWatch::kTold_s), "");
  EXPECT_EQ(watch.trouble(2.1 + SendWatch::kTold_s), "");
}

}  // namespace
}  // namespace ignis::runtime
