// SPDX-License-Identifier: Apache-2.0
#include "drivers/l1_decoder.h"

#include <algorithm>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "drivers/l1_samples.h"
#include "drivers/sensor_watch.h"

namespace ignis::l1 {
namespace {

using samples::append;
using samples::Bytes;

DriverConfig capture_config() {
  DriverConfig config;
  config.time_source = "counters";
  config.range_min_m = 0.0;
  config.range_max_m = 50.0;
  return config;
}

/// Sensor frame = body frame, up to the names of the axes.
Extrinsics plain_mount() {
  Extrinsics extrinsics;
  extrinsics.lidar.axes = "right_up_back";
  extrinsics.imu.axes = "right_up_back";
  return extrinsics;
}

struct Output {
  std::vector<ImuSample> imu;
  std::vector<Scan> scans;
};

void sort_into(Output& output, std::vector<Event> events) {
  for (Event& event : events) {
    if (auto* sample = std::get_if<ImuSample>(&event)) output.imu.push_back(*sample);
    if (auto* scan = std::get_if<Scan>(&event)) output.scans.push_back(std::move(*scan));
  }
}

Output decode_all(L1Decoder& decoder, const Bytes& stream, std::size_t chunk = 512) {
  Output output;
  for (std::size_t begin = 0; begin < stream.size(); begin += chunk) {
    sort_into(output, decoder.feed(std::span(stream).subspan(begin, std::min(chunk, stream.size() - begin)), 0));
  }
  sort_into(output, decoder.finish());
  return output;
}

std::size_t points_in(const Output& output) {
  std::size_t count = 0;
  for (const Scan& scan : output.scans) count += scan.points.size();
  return count;
}

TEST(L1Decoder, DecodesTheGoldenStreamAsTheVendorDoes) {
  L1Decoder decoder(capture_config(), plain_mount());
  const Output output = decode_all(decoder, samples::read_bytes("golden_clean.bin"));

  const auto imu_rows = samples::read_rows("golden_clean_imu.csv");
  ASSERT_EQ(output.imu.size(), imu_rows.size());
  for (std::size_t i = 0; i < imu_rows.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_FLOAT_EQ(static_cast<float>(output.imu[i].gyro[axis]),
                      std::stof(imu_rows[i][5 + static_cast<std::size_t>(axis)]));
      EXPECT_FLOAT_EQ(static_cast<float>(output.imu[i].accel[axis]),
                      std::stof(imu_rows[i][8 + static_cast<std::size_t>(axis)]));
    }
    EXPECT_EQ(output.imu[i].sequence, static_cast<int>(i));
  }

  const auto point_rows = samples::read_rows("golden_clean_points.csv");
  ASSERT_EQ(points_in(output), point_rows.size());
  auto row = point_rows.begin();
  for (const Scan& scan : output.scans) {
    for (const ScanPoint& point : scan.points) {
      const Eigen::Vector3f theirs(std::stof((*row)[2]), std::stof((*row)[3]), std::stof((*row)[4]));
      ASSERT_LT((point.position - theirs).norm(), 0.0002F);
      ++row;
    }
  }
  const DecoderCounters counters = decoder.counters();
  EXPECT_EQ(counters.pairing.paired, 36);
  EXPECT_EQ(counters.framing.crc_errors, 0);
  EXPECT_EQ(counters.framing.skipped_bytes, 0);
  EXPECT_EQ(counters.scan_gaps, 0);
  EXPECT_EQ(counters.imu_gaps, 0);
  EXPECT_EQ(counters.points_published, std::ssize(point_rows));
  EXPECT_EQ(decoder.newest_utime(), std::max(output.imu.back().utime, output.scans.back().end_utime()));
}

TEST(L1Decoder, LosesFromTheFaultyStreamOnlyWhatWasDamaged) {
  L1Decoder decoder(capture_config(), plain_mount());
  const Output output = decode_all(decoder, samples::read_bytes("golden_faults.bin"));
  EXPECT_EQ(output.imu.size(), 49U);
  const DecoderCounters counters = decoder.counters();
  EXPECT_EQ(counters.imu_gaps, 1);
  EXPECT_EQ(counters.pairing.paired, 33);
  EXPECT_EQ(counters.scan_gaps, 3);
  EXPECT_EQ(counters.duplicates, 1);
  EXPECT_EQ(counters.pairing.unpaired, 3);
  EXPECT_GE(counters.framing.crc_errors, 3);
  EXPECT_GE(counters.framing.resyncs, 4);

  std::set<std::string> damaged = {"3", "5", "11"};
  std::int64_t expected = 0;
  for (const auto& row : samples::read_rows("golden_clean_points.csv")) expected += damaged.contains(row[0]) ? 0 : 1;
  EXPECT_EQ(counters.points_published, expected);
  std::int32_t missing = 0;
  for (const Scan& scan : output.scans) missing += scan.missing_packets;
  EXPECT_EQ(missing, 3);
}

TEST(L1Decoder, NeverPublishesAlteredValues) {
  const Bytes clean = samples::read_bytes("golden_clean.bin");
  std::set<std::array<double, 3>> sent_forces;
  L1Decoder reference(capture_config(), plain_mount());
  for (const ImuSample& sample : decode_all(reference, clean).imu) {
    sent_forces.insert({sample.accel.x(), sample.accel.y(), sample.accel.z()});
  }
  for (unsigned seed = 0; seed < 30; ++seed) {
    std::mt19937 random(seed);
    Bytes damaged = clean;
    for (int i = 0; i < 5; ++i) damaged[random() % damaged.size()] ^= static_cast<std::byte>(1U << random() % 8);
    L1Decoder decoder(capture_config(), plain_mount());
    const Output output = decode_all(decoder, damaged);
    for (const ImuSample& sample : output.imu) {
      EXPECT_TRUE(sent_forces.contains({sample.accel.x(), sample.accel.y(), sample.accel.z()}));
    }
    const std::int64_t lost = 50 - std::ssize(output.imu) + 36 - decoder.counters().pairing.paired;
    EXPECT_LE(lost, 5) << "seed " << seed;
  }
}

TEST(L1Decoder, AnswersTimeSyncRequestsAtOnce) {
  L1Decoder decoder(capture_config(), plain_mount());
  (void)decoder.feed(samples::frame(kTimeSyncId, TimeSync{7, TimeSync::kRequest}), 0);
  EXPECT_EQ(decoder.take_outgoing(), samples::frame(kTimeSyncId, TimeSync{7, TimeSync::kResponse}, 0));
  EXPECT_TRUE(decoder.take_outgoing().empty());
  (void)decoder.feed(samples::frame(kTimeSyncId, TimeSync{8, TimeSync::kResponse}), 0);
  EXPECT_TRUE(decoder.take_outgoing().empty());
}

TEST(L1Decoder, AsksForTheVersionAndKeepsTheAnswer) {
  L1Decoder decoder(capture_config(), plain_mount());
  EXPECT_EQ(decoder.version_request(), samples::frame(kRequestDataId, DataRequest::kVersion));
  EXPECT_EQ(decoder.housekeeping().firmware, "");
  (void)decoder.feed(samples::frame(kVersionId, Version{"1.0.1+230601", "", "", ""}), 0);
  EXPECT_EQ(decoder.housekeeping().firmware, "1.0.1+230601");
}

TEST(L1Decoder, RejectsAbsurdContentAndSaysWhere) {
  L1Decoder decoder(capture_config(), plain_mount());
  Bytes stream;
  for (std::uint16_t id = 1; id <= 60; ++id) {
    ImuAttitude bad = samples::imu(id);
    bad.accel[0] = 1e28F;
    append(stream, samples::frame(kImuId, bad));
  }
  EXPECT_TRUE(decode_all(decoder, stream).imu.empty());
  EXPECT_EQ(decoder.counters().rejected_values, 60);
  EXPECT_EQ(decoder.health().rejected_in_a_row, 60);
  EXPECT_EQ(decoder.health().rejected_field, "linear_acceleration");
}

TEST(Fault_D2, AbsurdValuesOfOneMessageAreAFaultAmongGoodOnesOfTheOthers) {
  for (const bool is_imu_bad : {true, false}) {
    L1Decoder decoder(capture_config(), plain_mount());
    SensorWatch watch("a port");
    SensorReport report;
    for (std::uint16_t id = 1; id <= 60; ++id) {
      ImuAttitude sample = samples::imu(id);
      Auxiliary angles = samples::auxiliary(id);
      (is_imu_bad ? sample.accel[0] : angles.theta_rad) = 1e28F;
      Bytes stream = samples::frame(kImuId, sample);
      append(stream, samples::frame(kAuxiliaryId, angles));
      append(stream, samples::frame(kDistanceId, samples::distance(id)));
      (void)decoder.feed(stream, 0);
      report = watch.look(1'000'000 + 4'000 * id, "", decoder.counters(), decoder.health());
      EXPECT_EQ(report.severity == Severity::kFault, id >= 50) << id << ": " << report.text;
    }
    EXPECT_EQ(decoder.counters().rejected_values, 60);
    const std::string field = is_imu_bad ? "linear_acceleration" : "theta_angle";
    EXPECT_EQ(report.text, "60 frames in a row with impossible " + field);
  }
}

TEST(L1Decoder, CountsMessagesItDoesNotDecodeAndRepeats) {
  L1Decoder decoder(capture_config(), plain_mount());
  Bytes stream = encode_frame(122, Payload(20, std::byte{1}), 0);
  append(stream, samples::frame(kImuId, samples::imu(5)));
  append(stream, samples::frame(kImuId, samples::imu(5)));
  append(stream, samples::frame(kImuId, samples::imu(8)));
  EXPECT_EQ(decode_all(decoder, stream).imu.size(), 2U);
  EXPECT_EQ(decoder.counters().unknown_messages, 1);
  EXPECT_EQ(decoder.counters().duplicates, 1);
  EXPECT_EQ(decoder.counters().imu_gaps, 2);
}

TEST(L1Decoder, NoticesFrozenInertialValuesAndSaturation) {
  L1Decoder decoder(capture_config(), plain_mount());
  Bytes stream;
  for (std::uint16_t id = 0; id < 40; ++id) append(stream, samples::frame(kImuId, samples::imu(id)));
  (void)decode_all(decoder, stream);
  EXPECT_EQ(decoder.health().equal_gyro_samples, 39);
  EXPECT_EQ(decoder.health().equal_accel_samples, 39);

  L1Decoder fresh(capture_config(), plain_mount());
  ImuAttitude clipped = samples::imu(1);
  clipped.accel[2] = static_cast<float>(capture_config().accel_limit_m_s2);
  const Output output = decode_all(fresh, samples::frame(kImuId, clipped));
  ASSERT_EQ(output.imu.size(), 1U);
  EXPECT_TRUE(output.imu[0].saturated);
}

/// The judgement after `seconds` at 250 Hz, scans among them; `move` alters what the unit tells of a sample.
SensorReport after_samples(double seconds, void (*move)(ImuAttitude& sample)) {
  L1Decoder decoder(capture_config(), plain_mount());
  SensorWatch watch("a port");
  SensorReport report;
  for (std::uint16_t id = 0; id < seconds * 250; ++id) {
    ImuAttitude sample = samples::imu(id);
    move(sample);
    Bytes stream = samples::frame(kImuId, sample);
    append(stream, samples::frame(kAuxiliaryId, samples::auxiliary(id)));
    append(stream, samples::frame(kDistanceId, samples::distance(id)));
    (void)decoder.feed(stream, 0);
    report = watch.look(1'000'000 + 4'000 * id, "", decoder.counters(), decoder.health());
  }
  return report;
}

TEST(Fault_D3, HalfAnInertialUnitThatIsFrozenIsNamed) {
  const auto only_forces_move = [](ImuAttitude& sample) { sample.accel[1] += 0.01F * (sample.packet_id % 7); };
  const auto only_rates_move = [](ImuAttitude& sample) { sample.gyro[1] += 0.01F * (sample.packet_id % 7); };
  const auto nothing_moves = [](ImuAttitude&) {};
  EXPECT_EQ(after_samples(0.4, nothing_moves).text, "inertial values are frozen");
  for (const auto& [move, text] : {std::pair{+only_forces_move, "values of the gyro are frozen"},
                                   std::pair{+only_rates_move, "values of the accelerometer are frozen"}}) {
    const SensorReport report = after_samples(1.5, move);
    EXPECT_EQ(report.severity, Severity::kDegraded);
    EXPECT_EQ(report.text, text);
  }
}

TEST(Fault_D3, AQuietSensorThatRepeatsItsValuesForAWhileIsNotFrozen) {
  const auto coarse = [](ImuAttitude& sample) {
    sample.accel[2] += 0.01F * (sample.packet_id % 3);
    sample.gyro[0] += sample.packet_id % 200 == 0 ? 0.001F : 0.0F;
  };
  EXPECT_EQ(after_samples(3.0, coarse).text, "running");
}

TEST(L1Decoder, CountsFilteredPoints) {
  DriverConfig config = capture_config();
  config.range_max_m = 1.0;
  L1Decoder decoder(config, plain_mount());
  Bytes stream = samples::frame(kAuxiliaryId, samples::auxiliary(1));
  append(stream, samples::frame(kDistanceId, samples::distance(1)));
  EXPECT_EQ(points_in(decode_all(decoder, stream)), 0U);
  EXPECT_EQ(decoder.counters().points_filtered, 120);
}

TEST(L1Decoder, ReportsHousekeeping) {
  L1Decoder decoder(capture_config(), plain_mount());
  EXPECT_EQ(decoder.housekeeping().imu_temperature, -1000.0F);
  Auxiliary message = samples::auxiliary(1);
  message.imu_temperature = 45.25F;
  message.apd_temperature = 41.5F;
  message.dirty_index = 12.0F;
  message.work_status = 0x10;
  (void)decoder.feed(samples::frame(kAuxiliaryId, message), 0);
  EXPECT_EQ(decoder.housekeeping().imu_temperature, 45.25F);
  EXPECT_EQ(decoder.housekeeping().apd_temperature, 41.5F);
  EXPECT_EQ(decoder.housekeeping().dirty_index, 12.0F);
  EXPECT_EQ(decoder.housekeeping().work_status, 0x10);
}

}  // namespace
}  // namespace ignis::l1
