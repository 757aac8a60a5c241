// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/config_fields.h"

namespace ignis::runtime {

/// Section `lcm`: the bus. The URL is written here once; LCM_DEFAULT_URL and --lcm-url override it, in this order.
struct LcmConfig {
  std::string url = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152";
  // LCM keeps 30 messages per subscription and then drops the newest, silently: 120 ms of IMU. These are ours.
  int imu_queue = 5000;
  int scan_queue = 2000;
  double scan_backlog_s = 4.0;
  int keyframe_queue = 5000;
  int cloud_queue = 100;
  int state_queue = 500;

  void visit_fields(this auto& self, auto& visit) {
    visit.text("url", self.url, "LCM URL of the bus; ttl=0 never leaves the host, and recv_buf_size must be given");
    visit.integer("imu_queue", self.imu_queue, {100, 100000}, "messages", "queue of L1_IMU; 5000 are 20 s");
    visit.integer("scan_queue", self.scan_queue, {1, 100000}, "messages",
                  "queue of L1_SCAN, in parts; 2000 are 4 s of 128 beams");
    visit.number("scan_backlog_s", self.scan_backlog_s, {0.5, 1000.0}, "s",
                 "scans that may wait for lio_frontend; when more do, the oldest are left out");
    visit.integer("keyframe_queue", self.keyframe_queue, {10, 100000}, "messages",
                  "queue of the keyframe channels; graph_backend 200, map_builder 300 at most");
    visit.integer("cloud_queue", self.cloud_queue, {1, 10000}, "messages",
                  "queue of LIO_CLOUD, in parts; 100 are 5 s of an L1");
    visit.integer("state_queue", self.state_queue, {1, 10000}, "messages",
                  "queue of states that are only shown; 500 are 2 s");
  }
};

}  // namespace ignis::runtime
