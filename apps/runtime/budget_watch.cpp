// SPDX-License-Identifier: Apache-2.0
#include "runtime/budget_watch.h"

#include <algorithm>
#include <format>
#include <utility>

namespace ignis::runtime {
namespace {

constexpr double kLongestCredibleMs = 60'000.0;

void count(int& periods, double value, double limit) { periods = value > limit ? periods + 1 : 0; }

void tell(std::string& text, int periods, const std::string& what) {
  if (periods < BudgetWatch::kPatience) return;
  if (!text.empty()) text += "; ";
  text += what;
}

}  // namespace

void BudgetWatch::add_latency(double latency_ms) {
  if (latency_ms >= 0.0 && latency_ms <= kLongestCredibleMs)
    worst_latency_ms_ = std::max(worst_latency_ms_, latency_ms);
}

void BudgetWatch::sample(double now_s, const ProcessUsage& usage) {
  if (last_s_ && now_s > *last_s_) cpu_percent_ = 100.0 * (usage.cpu_s - last_cpu_s_) / (now_s - *last_s_);
  last_s_ = now_s;
  last_cpu_s_ = usage.cpu_s;
  memory_mb_ = usage.memory_mb;
  latency_ms_ = std::exchange(worst_latency_ms_, 0.0);
  if (!limits_) return;
  count(cpu_beyond_, cpu_percent_, limits_->cpu_percent);
  count(memory_beyond_, memory_mb_, limits_->memory_mb);
  count(latency_beyond_, latency_ms_, limits_->latency_ms);
}

std::string BudgetWatch::trouble() const {
  std::string text;
  if (!limits_) return text;
  tell(text, cpu_beyond_, std::format("CPU {:.0f} % of a core, limit {:.0f}", cpu_percent_, limits_->cpu_percent));
  tell(text, memory_beyond_, std::format("memory {:.0f} MB, limit {:.0f}", memory_mb_, limits_->memory_mb));
  tell(text, latency_beyond_, std::format("latency {:.0f} ms, limit {:.0f}", latency_ms_, limits_->latency_ms));
  return text;
}

}  // namespace ignis::runtime
