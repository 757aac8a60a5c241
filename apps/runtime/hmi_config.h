// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/config_fields.h"

namespace ignis::runtime {

/// Section `hmi`: where and to whom map_builder serves the browser view.
struct HmiConfig {
  std::string address = "127.0.0.1";
  int port = 8080;
  int max_clients = 32;
  double frame_rate_hz = 10.0;
  double max_view_radius_m = 150.0;
  std::string allowed_origin;  ///< empty: only pages that this server itself delivered

  void visit_fields(this auto& self, auto& visit) {
    visit.text("address", self.address, "address to listen on; loopback unless told otherwise");
    visit.integer("port", self.port, {0, 65535}, "1", "TCP port to listen on; 0 lets the system choose");
    visit.integer("max_clients", self.max_clients, {1, 1000}, "1", "viewers at the same time");
    visit.number("frame_rate_hz", self.frame_rate_hz, {0.1, 30.0}, "Hz", "map frames a second and viewer at most");
    visit.number("max_view_radius_m", self.max_view_radius_m, {1.0, 1000.0}, "m", "largest view radius served");
    visit.text("allowed_origin", self.allowed_origin, "one more web origin that may open the stream");
  }
};

}  // namespace ignis::runtime
