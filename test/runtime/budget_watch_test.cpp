// SPDX-License-Identifier: Apache-2.0
#include "runtime/budget_watch.h"

#include <gtest/gtest.h>

namespace ignis::runtime {
namespace {

constexpr ProcessLimits kLimits{.cpu_percent = 50.0, .memory_mb = 100.0, .latency_ms = 20.0};

struct Load {
  double cpu_share = 0.1;
  double memory_mb = 10.0;
  double latency_ms = 1.0;
};

/// Feeds one period after another, half a second each.
class Periods {
 public:
  explicit Periods(BudgetWatch& watch) : watch_(watch) { watch_.sample(0.0, {}); }

  void pass(int count, const Load& load) {
    for (int i = 0; i < count; ++i) {
      now_s_ += 0.5;
      cpu_s_ += 0.5 * load.cpu_share;
      watch_.add_latency(load.latency_ms);
      watch_.sample(now_s_, {.cpu_s = cpu_s_, .memory_mb = load.memory_mb});
    }
  }

 private:
  BudgetWatch& watch_;
  double now_s_ = 0.0;
  double cpu_s_ = 0.0;
};

TEST(BudgetWatch, TellsShareOfACoreMemoryAndLongestLatencyOfThePeriod) {
  BudgetWatch watch(kLimits);
  Periods periods(watch);
  watch.add_latency(7.0);
  periods.pass(1, {.cpu_share = 0.25, .memory_mb = 42.0, .latency_ms = 3.0});
  EXPECT_NEAR(watch.cpu_percent(), 25.0, 1e-9);
  EXPECT_EQ(watch.memory_mb(), 42.0);
  EXPECT_EQ(watch.latency_ms(), 7.0);
  periods.pass(1, {.latency_ms = 2.0});
  EXPECT_EQ(watch.latency_ms(), 2.0) << "the latency of an earlier period stayed";
}

TEST(BudgetWatch, NamesEachLimitThatWasExceededLongEnough) {
  const std::pair<Load, std::string> cases[] = {{{.cpu_share = 0.9}, "CPU 90 % of a core, limit 50"},
                                                {{.memory_mb = 150.0}, "memory 150 MB, limit 100"},
                                                {{.latency_ms = 35.0}, "latency 35 ms, limit 20"}};
  for (const auto& [load, text] : cases) {
    BudgetWatch watch(kLimits);
    Periods periods(watch);
    periods.pass(BudgetWatch::kPatience - 1, load);
    EXPECT_EQ(watch.trouble(), "") << "too early: " << text;
    periods.pass(1, load);
    EXPECT_EQ(watch.trouble(), text);
    periods.pass(1, {});
    EXPECT_EQ(watch.trouble(), "") << "did not end: " << text;
  }
}

TEST(BudgetWatch, LeavesOutLatenciesThatAStepOfTheClockMakes) {
  BudgetWatch watch(kLimits);
  watch.add_latency(-3.6e6);
  watch.add_latency(3.6e6);
  watch.sample(1.0, {});
  EXPECT_EQ(watch.latency_ms(), 0.0);
}

TEST(BudgetWatch, WithoutLimitsMeasuresAndNeverComplains) {
  BudgetWatch watch(std::nullopt);
  Periods periods(watch);
  periods.pass(20, {.cpu_share = 4.0, .memory_mb = 1e5, .latency_ms = 5e4});
  EXPECT_NEAR(watch.cpu_percent(), 400.0, 1e-9);
  EXPECT_EQ(watch.trouble(), "");
}

TEST(ProcessUsage, GrowsWithWorkAndKnowsItsMemory) {
  const ProcessUsage before = process_usage();
  volatile double sum = 0.0;
  while (process_usage().cpu_s < before.cpu_s + 0.02) {
    for (int i = 0; i < 100'000; ++i) sum = sum + i;
  }
  EXPECT_GT(before.memory_mb, 0.5);
  EXPECT_LT(before.memory_mb, 10'000.0);
}

}  // namespace
}  // namespace ignis::runtime
