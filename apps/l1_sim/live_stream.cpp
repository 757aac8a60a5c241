// SPDX-License-Identifier: Apache-2.0
#include "live_stream.h"

#include <format>
#include <iostream>
#include <thread>

#include "messages/odometry_messages.h"
#include "progress.h"
#include "pty_line.h"
#include "runtime/channels.h"
#include "runtime/lcm_link.h"
#include "runtime/stop_signal.h"

namespace ignis {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using SteadyClock = std::chrono::steady_clock;

constexpr milliseconds kWritePatience{200};
constexpr milliseconds kDrainTime{500};
constexpr milliseconds kReaderPoll{5};

/// False when a stop was asked for; throws when nobody came in time.
bool wait_for_reader(const PtyLine& line, const LiveOptions& options) {
  std::cerr << std::format("l1_sim: the sensor's port is {}; waiting up to {:.0f} s for a reader\n",
                           options.link.string(), options.wait_s);
  const auto deadline = SteadyClock::now() + std::chrono::duration<double>(options.wait_s);
  while (!line.has_reader()) {
    if (runtime::stop_requested()) return false;
    if (SteadyClock::now() > deadline) {
      throw runtime::UserError(
          std::format("nobody opened {} within {:.0f} s; start l1_driver --port {}, or give a longer "
                      "--wait",
                      options.link.string(), options.wait_s, options.link.string()),
          runtime::kFailed);
    }
    std::this_thread::sleep_for(kReaderPoll);
  }
  return true;
}

/// Sends frames at their instants and counts what nobody took.
class LiveSender {
 public:
  LiveSender(sim::L1Stream& stream, PtyLine& line, runtime::LcmLink& link)
      : stream_(stream), line_(line), link_(link) {}

  void send(const sim::StreamFrame& frame) {
    std::this_thread::sleep_until(start_steady_ + microseconds(frame.send_utime));
    line_.discard_input();
    // A sensor does not wait: without a reader its bytes are gone.
    if (!line_.has_reader() || !line_.write(frame.bytes, kWritePatience)) ++frames_lost_;
    if (frame.message_id == l1::kImuId) publish_truth(frame.measured_utime);
  }

  [[nodiscard]] std::int64_t frames_lost() const { return frames_lost_; }

 private:
  void publish_truth(Utime utime) {
    const sim::Motion motion = stream_.truth_at(utime);
    pose_t message = messages::ground_truth_message(start_host_ + utime, motion.T_world_body, motion.v_world);
    message.sequence = sequence_++;
    link_.publish(runtime::channels::kGroundTruth, message);
    const bool whole = frames_lost_ == 0;
    link_.report_health(message.utime, whole ? health_t::OK : health_t::DEGRADED,
                        whole ? "OK" : std::format("{} frames found no reader", frames_lost_));
  }

  sim::L1Stream& stream_;
  PtyLine& line_;
  runtime::LcmLink& link_;
  SteadyClock::time_point start_steady_ = SteadyClock::now();
  Utime start_host_ =
      std::chrono::duration_cast<microseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  std::int32_t sequence_ = 0;
  std::int64_t frames_lost_ = 0;
};

/// Leaves the reader time for the last bytes; it may also close earlier.
void drain(const PtyLine& line) {
  const auto deadline = SteadyClock::now() + kDrainTime;
  while (line.has_reader() && SteadyClock::now() < deadline && !runtime::stop_requested()) {
    std::this_thread::sleep_for(kReaderPoll);
  }
}

}  // namespace

runtime::ExitCode run_live(sim::L1Stream& stream, const LiveOptions& options, const runtime::Application& application) {
  PtyLine line(options.link);
  runtime::LcmLink link(application);
  if (!wait_for_reader(line, options)) return runtime::kDone;

  std::cerr << std::format("l1_sim: driving {:.0f} s in real time\n", stream.duration());
  Progress progress(stream.duration());
  LiveSender sender(stream, line, link);
  while (!runtime::stop_requested()) {
    const auto frame = stream.next_frame();
    if (!frame) break;
    sender.send(*frame);
    progress.show(static_cast<double>(frame->send_utime) * 1e-6);
  }
  drain(line);
  std::cerr << std::format("l1_sim: {} after {:.1f} s; {} frames found no reader, {} messages could not be sent\n",
                           runtime::stop_requested() ? "stopped" : "done", progress.elapsed(), sender.frames_lost(),
                           link.failed_sends());
  return runtime::kDone;
}

}  // namespace ignis
