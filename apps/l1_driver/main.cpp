// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <chrono>
#include <filesystem>
#include <format>
#include <fstream>
#include <iostream>
#include <optional>
#include <thread>

#include "common/file_output.h"
#include "driver_publisher.h"
#include "drivers/serial_port.h"
#include "runtime/stop_signal.h"

namespace ignis::runtime {
namespace {

constexpr int kReadTimeoutMs = 50;
constexpr Utime kReconnectUs = 500'000;

struct Options {
  std::string port;
  std::string capture;
  std::string record;
};

Utime steady_now() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// Wall time that a step of the system's clock does not disturb: read once, then carried by the steady clock.
class HostClock {
 public:
  [[nodiscard]] Utime now() const { return offset_ + steady_now(); }

 private:
  Utime offset_ =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
          .count() -
      steady_now();
};

/// The sensor on a serial port: reads, publishes, answers, and opens the port again when it was unplugged.
class LiveDriver {
 public:
  LiveDriver(const Application& application, const Options& options)
      : driver_(application.config.driver),
        decoder_(driver_, application.config.extrinsics),
        link_(application),
        publisher_(link_, decoder_) {
    open_port();
    if (!options.record.empty()) record_.emplace(options.record);
  }

  ExitCode run() {
    std::cout << std::format("l1_driver: reading {}\n", driver_.port) << std::flush;
    while (!stop_requested()) {
      try {
        if (port_) {
          exchange();
        } else {
          std::this_thread::sleep_for(std::chrono::microseconds(kReconnectUs));
          open_port();
          std::cerr << std::format("l1_driver: {} is back\n", driver_.port);
        }
      } catch (const l1::SerialError& error) {
        if (port_) std::cerr << "l1_driver: " << error.what() << ", trying again\n";
        port_.reset();
      }
      publisher_.report(steady_now(), port_.has_value());
    }
    for (const l1::Event& event : decoder_.finish()) publisher_.publish(event);
    if (record_) record_->commit();
    return kDone;
  }

 private:
  void open_port() { port_.emplace(driver_.port, driver_.baud); }

  void exchange() {
    const std::size_t count = port_->read(buffer_, kReadTimeoutMs);
    const auto bytes = std::span<const std::byte>(buffer_).first(count);
    if (record_) record_->stream().write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
    for (const l1::Event& event : decoder_.feed(bytes, host_clock_.now())) publisher_.publish(event);
    if (const auto answer = decoder_.take_outgoing(); !answer.empty()) port_->write(answer);
    ask_for_version();
  }

  void ask_for_version() {
    const Utime now = steady_now();
    if (!decoder_.housekeeping().firmware.empty() || now - last_request_ < kMicrosPerSecond) return;
    last_request_ = now;
    port_->write(decoder_.version_request());
  }

  DriverConfig driver_;
  l1::L1Decoder decoder_;
  LcmLink link_;
  DriverPublisher publisher_;
  HostClock host_clock_;
  std::optional<l1::SerialPort> port_;
  std::optional<FileOutput> record_;
  std::array<std::byte, 4096> buffer_{};
  Utime last_request_ = 0;
};

std::ifstream open_capture(const std::string& path) {
  if (!std::filesystem::exists(path))
    throw UserError(std::format("{} does not exist: name a recorded byte stream", path));
  if (!std::filesystem::is_regular_file(path))
    throw UserError(std::format("{} is not a file; a device is read with --port", path));
  std::ifstream file(path, std::ios::binary);
  if (!file) throw UserError(std::format("cannot read {}: check its permissions", path));
  return file;
}

/// A recorded byte stream: at the sensor's pace on a live bus, as fast as possible into a log file.
ExitCode play_capture(const Application& application, const std::string& path) {
  std::ifstream file = open_capture(path);
  DriverConfig driver = application.config.driver;
  driver.time_source = "counters";
  l1::L1Decoder decoder(driver, application.config.extrinsics);
  LcmLink link(application);
  DriverPublisher publisher(link, decoder);
  const bool paced = !application.config.lcm.url.starts_with("file:");

  std::optional<Utime> pace_offset;
  const auto publish_all = [&](const std::vector<l1::Event>& events) {
    for (const l1::Event& event : events) {
      const Utime due = decoder.newest_utime();
      if (!pace_offset) pace_offset = steady_now() - due;
      if (paced) std::this_thread::sleep_for(std::chrono::microseconds(due + *pace_offset - steady_now()));
      publisher.publish(event);
    }
    publisher.report(paced ? steady_now() : decoder.newest_utime(), true);
  };
  std::array<char, 1024> buffer{};
  while (!stop_requested() && (file.read(buffer.data(), std::ssize(buffer)) || file.gcount() > 0)) {
    const auto bytes = std::as_bytes(std::span(buffer)).first(static_cast<std::size_t>(file.gcount()));
    publish_all(decoder.feed(bytes, 0));
  }
  publish_all(decoder.finish());

  const l1::DecoderCounters counters = decoder.counters();
  std::cout << std::format("l1_driver: {}: {} scans, {} inertial samples, {} checksum errors, {} packets missing\n",
                           path, counters.scans_published, counters.imu_published, counters.framing.crc_errors,
                           counters.scan_gaps);
  if (counters.framing.frames > 0) return kDone;
  throw UserError(std::format("{} holds no frame of an L1: is it a raw byte stream of the sensor?", path),
                  kInputDamaged);
}

ExitCode run(const Application& application, const Options& options) {
  if (!options.capture.empty()) return play_capture(application, options.capture);
  Application with_port = application;
  if (!options.port.empty()) with_port.config.driver.port = options.port;
  try {
    return LiveDriver(with_port, options).run();
  } catch (const l1::SerialError& error) {
    throw UserError(error.what(), kFailed);
  }
}

}  // namespace
}  // namespace ignis::runtime

int main(int argc, char** argv) {
  using namespace ignis::runtime;
  Options options;
  return run_application(
      "l1_driver", "Reads a Unitree L1 and publishes L1_IMU, L1_SCAN and L1_STATUS", argc, argv,
      [&](CLI::App& app) {
        auto* port = app.add_option("--port", options.port, "serial device or pty (default: driver.port)");
        auto* record = app.add_option("--record", options.record, "also write the raw bytes into this file");
        app.add_option("--capture", options.capture, "decode this file of raw bytes instead of a device")
            ->excludes(port)
            ->excludes(record);
      },
      [&](const Application& application) { return run(application, options); });
}
