// SPDX-License-Identifier: Apache-2.0
#include "capture.h"

#include <format>
#include <iostream>
#include <memory>

#include "common/file_output.h"
#include "common/trajectory_file.h"
#include "decoded_log.h"
#include "fault_report.h"
#include "progress.h"
#include "runtime/stop_signal.h"

namespace ignis {
namespace {

/// The bytes as they are.
class RawFile final : public StreamFile {
 public:
  explicit RawFile(const std::filesystem::path& path) : output_(path) {}
  void add(const sim::Delivery& delivery) override {
    output_.stream().write(reinterpret_cast<const char*>(delivery.bytes.data()), std::ssize(delivery.bytes));
  }
  void add_truth(Utime, const sim::Motion&) override {}
  void commit() override { output_.commit(); }

 private:
  FileOutput output_;
};

std::unique_ptr<StreamFile> open_output(const OutputFiles& files, const runtime::Application& application) {
  if (files.log.empty()) return std::make_unique<RawFile>(files.bytes);
  return std::make_unique<DecodedLog>(files.log, application);
}

}  // namespace

runtime::ExitCode write_files(sim::L1Stream& stream, sim::ByteFaults& faults, const OutputFiles& files,
                              const runtime::Application& application) {
  const std::unique_ptr<StreamFile> output = open_output(files, application);
  Trajectory truth;
  Progress progress(stream.duration());
  std::int64_t byte_count = 0;
  const auto add = [&](const std::vector<sim::Delivery>& deliveries) {
    for (const sim::Delivery& each : deliveries) {
      output->add(each);
      byte_count += std::ssize(each.bytes);
    }
  };
  while (const auto frame = stream.next_frame()) {
    if (runtime::stop_requested()) {
      std::cerr << "l1_sim: interrupted; no file was written\n";
      return runtime::kFailed;
    }
    add(faults.pass(*frame));
    if (frame->message_id == l1::kImuId) {
      const sim::Motion motion = stream.truth_at(frame->measured_utime);
      truth.push_back({frame->measured_utime, motion.T_world_body});
      output->add_truth(frame->measured_utime, motion);
    }
    progress.show(static_cast<double>(frame->send_utime) * 1e-6);
  }
  add(faults.finish());
  if (!files.ground_truth.empty()) write_tum(files.ground_truth, truth);
  output->commit();
  std::cerr << std::format("l1_sim: {:.1f} s of sensor time, {:.1f} MB, in {:.1f} s; {}\n", stream.duration(),
                           static_cast<double>(byte_count) * 1e-6, progress.elapsed(), summary(faults));
  return runtime::kDone;
}

}  // namespace ignis
