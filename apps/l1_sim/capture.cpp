// SPDX-License-Identifier: Apache-2.0
#include "capture.h"

#include <format>
#include <iostream>

#include "common/file_output.h"
#include "common/trajectory_file.h"
#include "progress.h"
#include "runtime/stop_signal.h"

namespace ignis {

runtime::ExitCode write_capture(sim::L1Stream& stream, const CaptureFiles& files) {
  FileOutput output(files.bytes);
  Trajectory truth;
  Progress progress(stream.duration());
  std::size_t byte_count = 0;
  while (const auto frame = stream.next_frame()) {
    if (runtime::stop_requested()) {
      std::cerr << "l1_sim: interrupted; no file was written\n";
      return runtime::kFailed;
    }
    output.stream().write(reinterpret_cast<const char*>(frame->bytes.data()),
                          static_cast<std::streamsize>(frame->bytes.size()));
    byte_count += frame->bytes.size();
    if (frame->message_id == l1::kImuId) {
      truth.push_back({frame->measured_utime, stream.truth_at(frame->measured_utime).T_world_body});
    }
    progress.show(static_cast<double>(frame->send_utime) * 1e-6);
  }
  if (!files.ground_truth.empty()) write_tum(files.ground_truth, truth);
  output.commit();
  std::cerr << std::format("l1_sim: {:.1f} s of sensor time, {:.1f} MB, in {:.1f} s\n", stream.duration(),
                           static_cast<double>(byte_count) * 1e-6, progress.elapsed());
  return runtime::kDone;
}

}  // namespace ignis
