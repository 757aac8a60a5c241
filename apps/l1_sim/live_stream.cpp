// SPDX-License-Identifier: Apache-2.0
#include "live_stream.h"

#include <format>
#include <iostream>
#include <thread>

#include "fault_report.h"
#include "live_sender.h"
#include "progress.h"
#include "runtime/lcm_link.h"
#include "runtime/stop_signal.h"

namespace ignis {
namespace {

constexpr std::chrono::milliseconds kDrainTime{500};
constexpr std::chrono::milliseconds kReaderPoll{5};

/// Leaves the reader time for the last bytes; it may also close earlier.
void drain(const HostLine& line) {
  const auto deadline = HostLine::Clock::now() + kDrainTime;
  while (line.has_reader() && HostLine::Clock::now() < deadline && !runtime::stop_requested()) {
    std::this_thread::sleep_for(kReaderPoll);
  }
}

std::string what_the_host_said(const sim::HostCounters& counters) {
  return std::format(
      "{} version queries, {} time-sync queries, {} time-sync answers, {} mode commands, {} LED commands, {} commands "
      "let pass unheard, {} unknown messages, {} broken frames, {} bytes outside frames",
      counters.version_queries, counters.sync_queries, counters.sync_answers, counters.mode_commands,
      counters.led_commands, counters.ignored, counters.unknown, counters.broken_frames, counters.skipped_bytes);
}

}  // namespace

runtime::ExitCode run_live(const LiveSensor& sensor, const runtime::Application& application) {
  runtime::LcmLink link(application);
  std::cerr << std::format("l1_sim: driving {:.0f} s in real time\n", sensor.stream.duration());
  Progress progress(sensor.stream.duration());
  LiveSender sender(sensor, link);
  while (!runtime::stop_requested()) {
    const auto frame = sensor.stream.next_frame();
    if (!frame) break;
    sender.send(*frame);
    progress.show(static_cast<double>(frame->send_utime) * 1e-6);
  }
  sender.finish();
  drain(sensor.line);
  std::cerr << std::format(
      "l1_sim: {} after {:.1f} s; {} frames found no reader, {} messages could not be sent, latest frame {:.1f} ms "
      "behind its time\n",
      runtime::stop_requested() ? "stopped" : "done", progress.elapsed(), sender.frames_lost(), link.failed_sends(),
      static_cast<double>(sender.latest()) * 1e-3);
  std::cerr << std::format("l1_sim: faults: {}\n", summary(sensor.faults));
  const sim::HostCounters counters = sensor.listener.counters();
  std::cerr << std::format("l1_sim: host: {}\n", what_the_host_said(counters));
  if (counters.forbidden == 0) return runtime::kDone;
  throw runtime::UserError(
      std::format("ERROR: the host sent {} messages 123 or 124, which overwrite a real sensor's calibration",
                  counters.forbidden),
      runtime::kFailed);
}

}  // namespace ignis
