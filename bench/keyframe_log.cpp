// SPDX-License-Identifier: Apache-2.0
//
// keyframe_log: the front end alone over a drive's log; its keyframes as an LCM log of LIO_KEYFRAME. Back ends can then
// be compared over the same keyframes without waiting for the front end each time (graph_drive).
//
//     ninja -C build/release benchmarks
//     build/release/bin/keyframe_log DRIVE.lcm -o KEYFRAMES.lcm --config config/ignis8_tuned.json

#include <cstdio>
#include <iostream>
#include <vector>

#include <lcm/lcm-cpp.hpp>

#include "common/file_output.h"
#include "frontend/lio.h"
#include "messages/keyframe_messages.h"
#include "messages/lio_command.h"
#include "replay_input.h"
#include "runtime/application.h"
#include "runtime/channels.h"
#include "runtime/stop_signal.h"

namespace {

using namespace ignis;

class KeyframeWriter {
 public:
  explicit KeyframeWriter(const std::filesystem::path& path)
      : output_(path), log_(output_.temporary_path().string(), "w") {
    if (!log_.good()) throw runtime::UserError("cannot write " + path.string(), runtime::kFailed);
  }

  void take(const std::vector<ScanResult>& scans) {
    for (const ScanResult& scan : scans) {
      if (!scan.keyframe) continue;
      ++count_;
      for (const keyframe_t& part : messages::to_messages(*scan.keyframe)) write(part);
    }
  }

  int commit() {
    failed_ |= std::fflush(log_.getFilePtr()) != 0;
    if (failed_) throw runtime::UserError("cannot write the log: is the disk full?", runtime::kFailed);
    output_.commit();
    return count_;
  }

 private:
  void write(const keyframe_t& part) {
    buffer_.resize(static_cast<std::size_t>(part.getEncodedSize()));
    part.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
    lcm::LogEvent record{.eventnum = 0,
                         .timestamp = part.utime,
                         .channel = runtime::channels::kKeyframe,
                         .datalen = static_cast<std::int32_t>(buffer_.size()),
                         .data = buffer_.data()};
    failed_ |= log_.writeEvent(&record) != 0;
  }

  FileOutput output_;
  lcm::LogFile log_;
  std::vector<char> buffer_;
  int count_ = 0;
  bool failed_ = false;
};

}  // namespace

int main(int argc, char** argv) {
  std::string log;
  std::string out;
  return runtime::run_application(
      "keyframe_log", "Runs the front end over a drive's log and keeps its keyframes.", argc, argv,
      [&](CLI::App& app) {
        app.add_option("log", log, "LCM log with L1_IMU and L1_SCAN")->required();
        app.add_option("-o,--out", out, "LCM log of LIO_KEYFRAME")->required();
      },
      [&](const runtime::Application& application) {
        const ReplayInput input(log);
        KeyframeWriter writer(out);
        Lio lio(application.config.frontend.filter);
        input.run({.on_imu = [&](const ImuSample& sample) { writer.take(lio.add_imu(sample).scans); },
                   .on_scan = [&](const Scan& scan) { writer.take(lio.add_scan(scan)); },
                   .on_command = [&](const lio_command_t& command) { (void)messages::carry_out(command, lio); },
                   .proceed = [](Utime) { return !runtime::stop_requested(); }});
        std::cout << writer.commit() << " keyframes\n";
        return runtime::kDone;
      });
}
