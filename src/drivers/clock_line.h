// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

namespace ignis::l1 {

/// Which side of the sought line the data lies on.
enum class Bound {
  kUpper,  ///< every datum is too late, by an unknown delay: the line lies below all of them
  kLower,  ///< every datum is too early: the line lies above all of them
};

/// Fits time = offset + rate * count to data that are wrong in one direction only. Of all lines that keep to their side
/// it is the one with the least sum of distances: the edge of the convex hull over the mean of the counts (linear
/// programming method of Moon, Skelly and Towsley, "Estimation and removal of clock skew from network delay
/// measurements", INFOCOM 1999). Only the best datum of each tenth of a second within the window is kept.
class ClockLine {
 public:
  /// `window_us`: how much of the past counts. Rates are believed within +-5000 ppm of the nominal period.
  ClockLine(double period_us, double window_us, Bound bound);

  /// Adds a datum; counts must not go down. A datum beyond the line by more than 100 ms, or data that stay that far off
  /// for a second, mean that the counter lost its meaning: the fit starts afresh from it. Data whose distance changes
  /// in that second have waited in a queue that fills or drains, and are late only.
  void add(std::int64_t count, double time_us);

  /// Starts afresh from the next datum.
  void forget() { best_.clear(); }

  [[nodiscard]] bool empty() const { return best_.empty(); }
  /// [us] the line's time at a count; 0 while empty.
  [[nodiscard]] double at(std::int64_t count) const;
  /// [us] between the counts of the oldest and the newest datum in use.
  [[nodiscard]] double span_us() const;
  /// [1e-6] rate of the count over nominal, as seen by the clock of the data.
  [[nodiscard]] double drift_ppm() const;
  /// [us] median distance of the latest data from the line.
  [[nodiscard]] double jitter_us() const;
  [[nodiscard]] std::int64_t restarts() const { return restarts_; }

 private:
  /// A datum relative to the first one: x = count * period, y = signed excess over x (kUpper: positive is later).
  struct Point {
    double x;
    double y;
  };

  /// Data that are far off: since when, and the least excess of the first and the second half second.
  struct Astray {
    double since_x;
    double least_before = std::numeric_limits<double>::infinity();
    double least_after = std::numeric_limits<double>::infinity();
  };

  [[nodiscard]] bool stays_astray(const Point& point);
  [[nodiscard]] double excess_of_line(double x) const { return offset_ + slope_ * (x - pivot_); }
  void restart(std::int64_t count, double time_us);
  void keep(const Point& point);
  void fit();

  double period_us_;
  double window_us_;
  double sign_;
  std::int64_t first_count_ = 0;
  double first_time_ = 0.0;
  std::deque<Point> best_;  ///< best datum per bucket, oldest first
  double slope_ = 0.0;      ///< [1] of the excess
  double offset_ = 0.0;     ///< [us] excess at pivot_
  double pivot_ = 0.0;
  std::optional<Astray> astray_;
  std::deque<double> recent_distance_;
  std::int64_t restarts_ = 0;
};

}  // namespace ignis::l1
