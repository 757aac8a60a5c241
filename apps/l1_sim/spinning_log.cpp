// SPDX-License-Identifier: Apache-2.0
#include "spinning_log.h"

#include <algorithm>
#include <cmath>
#include <format>
#include <iostream>

#include "common/trajectory_file.h"
#include "progress.h"
#include "runtime/stop_signal.h"
#include "sensor_log.h"

namespace ignis {
namespace {

struct Written {
  std::int64_t scans = 0;
  std::int64_t points = 0;
  Trajectory truth;
};

void write_sample(ImuSample sample, Utime start, const sim::SpinningStream& stream, SensorLog& log, Written& written) {
  const sim::Motion motion = stream.truth_at(sample.utime);
  // The truth's file counts from the drive's start, as for an L1; the bus has the configured start time.
  written.truth.push_back({sample.utime, motion.T_world_body});
  sample.utime += start;
  log.add(sample);
  log.add_truth(sample.utime, motion);
}

void write_scan(Scan scan, Utime start, SensorLog& log, Written& written) {
  ++written.scans;
  written.points += std::ssize(scan.points);
  scan.utime += start;
  log.add(scan);
}

}  // namespace

runtime::ExitCode write_spinning_log(sim::SpinningStream& stream, const OutputFiles& files,
                                     const runtime::Application& application) {
  const Utime start = std::llround(application.config.driver.start_time_s * 1e6);
  SensorLog log(files.log);
  Progress progress(stream.duration());
  Written written;
  while (auto event = stream.next()) {
    if (runtime::stop_requested()) {
      std::cerr << "l1_sim: interrupted; no file was written\n";
      return runtime::kFailed;
    }
    if (auto* sample = std::get_if<ImuSample>(&*event)) {
      progress.show(static_cast<double>(sample->utime) * 1e-6);
      write_sample(*sample, start, stream, log, written);
    } else {
      write_scan(std::get<Scan>(std::move(*event)), start, log, written);
    }
  }
  if (!files.ground_truth.empty()) write_tum(files.ground_truth, written.truth);
  log.commit();
  std::cerr << std::format(
      "l1_sim: {:.1f} s of sensor time, {} scans of {:.0f} points on average, in {:.1f} s\n", stream.duration(),
      written.scans,
      static_cast<double>(written.points) / static_cast<double>(std::max<std::int64_t>(written.scans, 1)),
      progress.elapsed());
  return runtime::kDone;
}

}  // namespace ignis
