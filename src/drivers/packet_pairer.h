// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "common/time.h"
#include "drivers/l1_messages.h"

namespace ignis::l1 {

/// Angles and ranges that belong together.
struct PacketPair {
  Auxiliary auxiliary;
  Distance distance;
};

struct PairCounters {
  std::int64_t paired = 0;
  std::int64_t unpaired = 0;    ///< AUX or DISTANCE without its other half
  std::int64_t duplicates = 0;  ///< DISTANCE whose AUX was already used
};

/// Joins an AUX with the DISTANCE that follows it. A DISTANCE takes the latest AUX only, only once, only with the same
/// id, and only when it is fresh: fusing ranges with stale angles is a fault seen in real recordings.
class PacketPairer {
 public:
  /// Call for every valid frame of any kind, before the calls below.
  void on_frame() { ++frames_since_auxiliary_; }
  void on_auxiliary(const Auxiliary& auxiliary, double at_us);
  [[nodiscard]] std::optional<PacketPair> on_distance(const Distance& distance, double at_us);

  [[nodiscard]] const PairCounters& counters() const { return counters_; }

 private:
  [[nodiscard]] bool is_fresh(double at_us) const;

  std::optional<Auxiliary> waiting_;
  double waiting_since_us_ = 0.0;
  int frames_since_auxiliary_ = 0;
  std::optional<std::uint16_t> last_paired_id_;
  PairCounters counters_;
};

}  // namespace ignis::l1
