// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/sim/byte_faults.h"
#include "drivers/sim/host_listener.h"
#include "host_line.h"
#include "runtime/application.h"

namespace ignis {

/// A simulated sensor on its line to the host.
struct LiveSensor {
  sim::L1Stream& stream;
  sim::ByteFaults& faults;
  sim::HostListener& listener;
  HostLine& line;
};

/// Sends the stream in real time, obeys the host, and publishes the true pose on GROUND_TRUTH. Ends well after the last
/// byte was taken, or at Ctrl-C. Fails at the end when the host sent messages that would have spoilt a real sensor.
[[nodiscard]] runtime::ExitCode run_live(const LiveSensor& sensor, const runtime::Application& application);

}  // namespace ignis
