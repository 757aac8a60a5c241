// SPDX-License-Identifier: Apache-2.0
#include "decode.h"

#include <array>
#include <format>
#include <fstream>
#include <iostream>
#include <optional>

#include "common/file_output.h"
#include "drivers/packet_stream.h"
#include "drivers/scan_geometry.h"

namespace ignis {
namespace {

/// The vendor's library drops what is farther.
constexpr double kVendorRangeM = 50.0;

class Tables {
 public:
  Tables(const DecodeFiles& files, const DriverConfig& config) : config_(config) {
    if (!files.points.empty()) points_.emplace(files.points).stream() << "scan,j,x,y,z,intensity\n";
    if (!files.imu.empty()) imu_.emplace(files.imu).stream() << "packet_id,qw,qx,qy,qz,wx,wy,wz,ax,ay,az\n";
  }

  void write(const std::vector<l1::Packet>& packets) {
    for (const l1::Packet& packet : packets) std::visit([this](const auto& each) { add(each); }, packet);
  }

  void commit() {
    if (points_) points_->commit();
    if (imu_) imu_->commit();
  }

  [[nodiscard]] std::int64_t pairs() const { return pairs_; }
  [[nodiscard]] std::int64_t points() const { return point_count_; }
  [[nodiscard]] std::int64_t samples() const { return samples_; }

 private:
  void add(const l1::CountedPacket& packet) {
    if (!first_count_) first_count_ = packet.count;
    ++pairs_;
    for (const l1::SensorPoint& point : l1::points_of(packet.pair, config_)) {
      ++point_count_;
      if (!points_) continue;
      points_->stream() << std::format("{},{},{:.6f},{:.6f},{:.6f},{:.0f}\n", packet.count - *first_count_, point.index,
                                       point.position.x(), point.position.y(), point.position.z(), point.intensity);
    }
  }

  void add(const l1::CountedImu& imu) {
    ++samples_;
    if (!imu_) return;
    const l1::ImuAttitude& a = imu.attitude;
    imu_->stream() << a.packet_id;
    const auto write_all = [this](const auto& values) {
      for (const float value : values) imu_->stream() << std::format(",{}", value);
    };
    write_all(a.quaternion);
    write_all(a.gyro);
    write_all(a.accel);
    imu_->stream() << '\n';
  }

  void add(const auto&) {}

  DriverConfig config_;
  std::optional<FileOutput> points_;
  std::optional<FileOutput> imu_;
  std::optional<std::int64_t> first_count_;
  std::int64_t pairs_ = 0;
  std::int64_t point_count_ = 0;
  std::int64_t samples_ = 0;
};

DriverConfig without_filters(DriverConfig config) {
  config.time_source = "counters";
  config.range_min_m = 0.0;
  config.range_max_m = kVendorRangeM;
  return config;
}

}  // namespace

runtime::ExitCode decode_capture(const DecodeFiles& files, const DriverConfig& config) {
  std::ifstream capture(files.capture, std::ios::binary);
  if (!capture || std::filesystem::is_directory(files.capture)) {
    throw runtime::UserError(std::format("cannot read {}: name a recorded byte stream", files.capture.string()));
  }
  const DriverConfig unfiltered = without_filters(config);
  l1::PacketStream stream(unfiltered);
  Tables tables(files, unfiltered);
  std::array<char, 65536> buffer{};
  while (capture.read(buffer.data(), std::ssize(buffer)) || capture.gcount() > 0) {
    const auto bytes = std::as_bytes(std::span(buffer)).first(static_cast<std::size_t>(capture.gcount()));
    tables.write(stream.feed(bytes, 0));
  }
  tables.write(stream.finish());

  const l1::StreamCounters counters = stream.counters();
  if (counters.framing.frames == 0) {
    throw runtime::UserError(
        std::format("{} holds no frame of an L1: is it a raw byte stream of the sensor?", files.capture.string()),
        runtime::kInputDamaged);
  }
  tables.commit();
  std::cout << std::format("{}: {} pairs with {} points, {} inertial samples\n", files.capture.string(), tables.pairs(),
                           tables.points(), tables.samples());
  const std::string damage = l1::damage_in(counters);
  if (damage.empty()) return runtime::kDone;
  std::cerr << "l1_tool: " << damage << '\n';
  return runtime::kInputDamaged;
}

}  // namespace ignis
