// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "frontend/lio_runner.h"

/// The drive that faults of the streams are put into, and a front end that is watched while it takes them.
namespace ignis::test {

/// 16 s through the hall, the first two at rest.
[[nodiscard]] const Drive& drive();

/// The first sample `seconds` after the first one of all, or later.
[[nodiscard]] std::vector<ImuSample>::iterator sample_at(Drive& input, double seconds);

/// Feeds a drive and notes the trust after each scan that arrives.
struct Watched {
  Lio lio;
  std::vector<ScanResult> scans;
  std::vector<std::pair<Utime, Trust>> trust;  ///< after each arrival

  explicit Watched(
      const Drive& input, const FrontendConfig& config = tuned_config(),
      const std::function<void(Lio&)>& before = [](Lio&) {},
      const std::function<void(Lio&, std::size_t scan)>& before_scan = [](Lio&, std::size_t) {});

  /// Seconds are those of drive().
  [[nodiscard]] Trust trust_at(double seconds) const;

  /// [m] Position error at the last scan against drive(), in the frame of the start.
  [[nodiscard]] double error_at_end() const;

 private:
  void take(std::vector<ScanResult> results);
};

}  // namespace ignis::test
