// SPDX-License-Identifier: Apache-2.0
#include "drivers/clock_line.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <ranges>
#include <vector>

namespace ignis::l1 {

namespace {

constexpr double kBucketUs = 100'000.0;
constexpr double kAstrayUs = 100'000.0;
constexpr double kAstrayForUs = 1'000'000.0;
constexpr double kSteadyUs = 50'000.0;
constexpr double kMaxSlope = 0.005;
/// Below this span the noise of single delays would read as clock drift.
constexpr double kMinSlopeSpanUs = 500'000.0;
constexpr std::size_t kRecent = 256;

}  // namespace

ClockLine::ClockLine(double period_us, double window_us, Bound bound)
    : period_us_(period_us), window_us_(window_us), sign_(bound == Bound::kUpper ? 1.0 : -1.0) {}

void ClockLine::add(std::int64_t count, double time_us) {
  if (best_.empty()) return restart(count, time_us);
  const double x = static_cast<double>(count - first_count_) * period_us_;
  const Point point{x, sign_ * (time_us - first_time_ - x)};
  const double distance = point.y - excess_of_line(x);
  if (distance < -kAstrayUs) {
    ++restarts_;
    return restart(count, time_us);
  }
  recent_distance_.push_back(std::max(distance, 0.0));
  if (recent_distance_.size() > kRecent) recent_distance_.pop_front();
  if (distance > kAstrayUs) {
    if (!stays_astray(point)) return;
    ++restarts_;
    return restart(count, time_us);
  }
  astray_.reset();
  const std::size_t before = best_.size();
  keep(point);
  if (distance < 0.0 || best_.size() != before) fit();
}

void ClockLine::restart(std::int64_t count, double time_us) {
  first_count_ = count;
  first_time_ = time_us;
  best_.assign(1, Point{0.0, 0.0});
  recent_distance_.clear();
  astray_.reset();
  fit();
}

bool ClockLine::stays_astray(const Point& point) {
  if (!astray_) astray_ = Astray{.since_x = point.x};
  const double for_us = point.x - astray_->since_x;
  double& least = for_us < 0.5 * kAstrayForUs ? astray_->least_before : astray_->least_after;
  least = std::min(least, point.y);
  if (for_us <= kAstrayForUs) return false;
  const bool steady = std::abs(astray_->least_after - astray_->least_before) < kSteadyUs;
  astray_.reset();
  return steady;
}

void ClockLine::keep(const Point& point) {
  const auto bucket = [](const Point& each) { return std::floor(each.x / kBucketUs); };
  if (bucket(point) != bucket(best_.back())) {
    best_.push_back(point);
  } else if (point.y - slope_ * point.x < best_.back().y - slope_ * best_.back().x) {
    best_.back() = point;
  }
  while (best_.front().x < point.x - window_us_) best_.pop_front();
}

void ClockLine::fit() {
  double mean = 0.0;
  for (const Point& point : best_) mean += point.x / static_cast<double>(best_.size());

  std::vector<Point> hull;
  const auto turns_left = [](const Point& a, const Point& b, const Point& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > 0.0;
  };
  for (const Point& point : best_) {
    while (hull.size() >= 2 && !turns_left(hull[hull.size() - 2], hull.back(), point)) hull.pop_back();
    hull.push_back(point);
  }
  const auto right = std::ranges::find_if(hull, [&](const Point& point) { return point.x > mean; });
  slope_ = 0.0;
  if (span_us() >= kMinSlopeSpanUs && right != hull.begin() && right != hull.end()) {
    const Point& left = *std::prev(right);
    slope_ = std::clamp((right->y - left.y) / (right->x - left.x), -kMaxSlope, kMaxSlope);
  }
  pivot_ = best_.back().x;
  offset_ = std::ranges::min(
      best_ | std::views::transform([&](const Point& point) { return point.y - slope_ * (point.x - pivot_); }));
}

double ClockLine::at(std::int64_t count) const {
  const double x = static_cast<double>(count - first_count_) * period_us_;
  return best_.empty() ? 0.0 : first_time_ + x + sign_ * excess_of_line(x);
}

double ClockLine::span_us() const { return best_.empty() ? 0.0 : best_.back().x - best_.front().x; }

double ClockLine::drift_ppm() const { return -sign_ * slope_ * 1e6; }

double ClockLine::jitter_us() const {
  if (recent_distance_.empty()) return 0.0;
  std::vector<double> sorted(recent_distance_.begin(), recent_distance_.end());
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::ranges::nth_element(sorted, middle);
  return *middle;
}

}  // namespace ignis::l1
