// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "common/measurements.h"
#include "ignis/scan_t.hpp"
#include "messages/part_assembler.h"

namespace ignis::messages {

/// The oracle of EncodedScanAssembler: parts as the generated decoder reads them, put together point by point.
class DecodedScanAssembler {
 public:
  [[nodiscard]] std::optional<Scan> add(const scan_t& part) {
    const std::optional<std::vector<scan_t>> parts = parts_.add(part);
    if (!parts) return std::nullopt;
    const scan_t& first = parts->front();
    Scan scan{.utime = first.utime,
              .sequence = first.sequence,
              .duration_us = first.duration_us,
              .missing_packets = first.missing_packets,
              .points = {}};
    for (const scan_t& each : *parts) {
      for (std::size_t i = 0; i < each.x.size(); ++i) {
        scan.points.push_back(
            {.position = {each.x[i], each.y[i], each.z[i]}, .intensity = each.intensity[i], .dt_us = each.dt_us[i]});
      }
    }
    return scan;
  }

 private:
  PartAssembler<scan_t> parts_;
};

}  // namespace ignis::messages
