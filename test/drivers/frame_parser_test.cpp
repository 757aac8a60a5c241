// SPDX-License-Identifier: Apache-2.0
#include "drivers/frame_parser.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "drivers/l1_samples.h"

namespace ignis::l1 {
namespace {

using samples::append;
using samples::Bytes;

std::vector<Frame> parse(const Bytes& stream, std::size_t chunk = SIZE_MAX) {
  FrameParser parser;
  std::vector<Frame> frames;
  for (std::size_t begin = 0; begin < stream.size(); begin += std::min(chunk, stream.size())) {
    parser.feed(std::span(stream).subspan(begin, std::min(chunk, stream.size() - begin)), 0);
    while (auto frame = parser.next()) frames.push_back(*frame);
  }
  parser.finish();
  while (auto frame = parser.next()) frames.push_back(*frame);
  return frames;
}

struct Stream {
  Bytes bytes;
  std::vector<std::size_t> ends;  ///< of each frame
};

/// Inertial frames, scans and time syncs with random content, so that false start bytes occur inside.
Stream random_stream(int frames, unsigned seed) {
  std::mt19937 random(seed);
  Stream stream;
  for (int i = 0; i < frames; ++i) {
    const std::uint32_t ids[] = {kImuId, kAuxiliaryId, kDistanceId, kTimeSyncId};
    const std::uint32_t id = ids[random() % 4];
    Payload payload(message_info(id)->length);
    for (std::byte& byte : payload) byte = random() % 8 == 0 ? kMagic : static_cast<std::byte>(random());
    append(stream.bytes, encode_frame(id, payload, static_cast<std::uint8_t>(i)));
    stream.ends.push_back(stream.bytes.size());
  }
  return stream;
}

bool same(const Frame& a, const Frame& b) { return a.id == b.id && a.sequence == b.sequence && a.payload == b.payload; }

/// Every found frame is one that was sent, in order: nothing altered came out. Returns how many were lost.
std::ptrdiff_t lost_and_unaltered(const std::vector<Frame>& sent, const std::vector<Frame>& found) {
  auto next = sent.begin();
  for (const Frame& frame : found) {
    next = std::find_if(next, sent.end(), [&](const Frame& each) { return same(each, frame); });
    if (next == sent.end()) {
      ADD_FAILURE() << "a frame came out that was never sent: id " << frame.id;
      return -1;
    }
    ++next;
  }
  return std::ssize(sent) - std::ssize(found);
}

TEST(FrameParser, FindsTheSameFramesWhateverTheReads) {
  const Bytes stream = samples::read_bytes("golden_clean.bin");
  const auto whole = parse(stream);
  EXPECT_EQ(whole.size(), samples::read_rows("golden_clean_frames.csv").size());
  for (const std::size_t chunk : {1U, 7U, 64U, 257U}) {
    const auto cut = parse(stream, chunk);
    ASSERT_EQ(cut.size(), whole.size());
    EXPECT_TRUE(std::ranges::equal(cut, whole, same));
  }
}

TEST(FrameParser, AcceptsAnySenderAndBothTrimmings) {
  Bytes stream;
  const Payload payload = encode(samples::imu(7));
  append(stream, encode_frame(kImuId, payload, 0, Trim::kYes, {1, 200}));
  append(stream, encode_frame(kImuId, payload, 1, Trim::kNo, {255, 0}));
  const auto frames = parse(stream);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(encode(decode_imu(frames[0].payload)), payload);
  EXPECT_EQ(frames[1].payload, payload);
}

TEST(FrameParser, LosesOnlyTheFrameWithTheFlippedBit) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const Stream stream = random_stream(30, seed);
    const auto sent = parse(stream.bytes);
    ASSERT_EQ(sent.size(), 30U);
    std::mt19937 random(seed);
    Bytes damaged = stream.bytes;
    const std::size_t hit = random() % damaged.size();
    damaged[hit] ^= static_cast<std::byte>(1U << random() % 8);
    EXPECT_LE(lost_and_unaltered(sent, parse(damaged, 100)), 1) << "seed " << seed << " byte " << hit;
  }
}

TEST(FrameParser, LosesOnlyTheFrameWithALostOrAnAddedByte) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const Stream stream = random_stream(30, seed);
    const auto sent = parse(stream.bytes);
    std::mt19937 random(seed);
    const auto hit = static_cast<std::ptrdiff_t>(random() % stream.bytes.size());
    Bytes shorter = stream.bytes;
    shorter.erase(shorter.begin() + hit);
    EXPECT_LE(lost_and_unaltered(sent, parse(shorter, 100)), 1) << "seed " << seed << " byte " << hit;
    Bytes longer = stream.bytes;
    longer.insert(longer.begin() + hit, kMagic);
    EXPECT_LE(lost_and_unaltered(sent, parse(longer, 100)), 1) << "seed " << seed << " byte " << hit;
  }
}

TEST(FrameParser, LosesNothingToJunkBetweenFrames) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Stream stream = random_stream(20, seed);
    const auto sent = parse(stream.bytes);
    std::mt19937 random(seed);
    Bytes junk(64 + random() % 4000);
    for (std::byte& byte : junk) byte = random() % 4 == 0 ? kMagic : static_cast<std::byte>(random());
    Bytes dirty = stream.bytes;
    const auto gap = static_cast<std::ptrdiff_t>(stream.ends[random() % stream.ends.size()]);
    dirty.insert(dirty.begin() + gap, junk.begin(), junk.end());
    EXPECT_EQ(lost_and_unaltered(sent, parse(dirty, 100)), 0) << "seed " << seed;
  }
}

TEST(FrameParser, CountsWhatItSkips) {
  Bytes stream = samples::from_hex("00 01 02");
  Bytes bad = samples::frame(kTimeSyncId, TimeSync{1, 1});
  bad.back() ^= std::byte{1};
  append(stream, bad);
  append(stream, samples::frame(kTimeSyncId, TimeSync{2, 1}));
  FrameParser parser;
  parser.feed(stream, 0);
  const auto frame = parser.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(decode_time_sync(frame->payload).count, 2U);
  EXPECT_EQ(parser.counters().bytes, std::ssize(stream));
  EXPECT_EQ(parser.counters().frames, 1);
  EXPECT_EQ(parser.counters().crc_errors, 1);
  EXPECT_EQ(parser.counters().skipped_bytes, 3 + std::ssize(bad));
  EXPECT_EQ(parser.counters().resyncs, 1);
}

TEST(FrameParser, SkipsSignedFramesWhole) {
  Bytes frame = samples::frame(kTimeSyncId, TimeSync{1, 1});
  frame[2] = std::byte{1};
  frame.resize(frame.size() - kChecksumSize);
  const std::byte extra[] = {std::byte{message_info(kTimeSyncId)->crc_extra}};
  const std::uint16_t crc = crc16(extra, crc16(std::span(frame).subspan(1)));
  frame.push_back(static_cast<std::byte>(crc));
  frame.push_back(static_cast<std::byte>(crc >> 8U));
  frame.resize(frame.size() + kSignatureSize, kMagic);
  append(frame, samples::frame(kTimeSyncId, TimeSync{2, 1}));
  FrameParser parser;
  parser.feed(frame, 0);
  const auto found = parser.next();
  ASSERT_TRUE(found);
  EXPECT_EQ(decode_time_sync(found->payload).count, 2U);
  EXPECT_EQ(parser.counters().signed_frames, 1);
  EXPECT_EQ(parser.counters().skipped_bytes, 0);
}

TEST(FrameParser, FreesFramesBehindAFalseStartWhenTheStreamEnds) {
  Bytes stream = samples::frame(kDistanceId, samples::distance(1));
  stream.resize(100);
  append(stream, samples::frame(kTimeSyncId, TimeSync{2, 1}));
  FrameParser parser;
  parser.feed(stream, 0);
  EXPECT_FALSE(parser.next());
  parser.finish();
  EXPECT_TRUE(parser.next());
}

TEST(FrameParser, BoundsTheSendingByTheLineTimeBeforeTheReadReturned) {
  const Bytes first = samples::frame(kTimeSyncId, TimeSync{1, 1});
  const Bytes second = samples::frame(kImuId, samples::imu(300));
  Bytes both = first;
  append(both, second);
  FrameParser parser;
  parser.feed(std::span(both).first(5), 1'000'000);
  parser.feed(std::span(both).subspan(5), 2'000'000);
  const double line_time = kByteTimeUs * static_cast<double>(both.size());
  EXPECT_DOUBLE_EQ(parser.next()->sent_before, 2e6 - line_time);
  EXPECT_DOUBLE_EQ(parser.next()->sent_before, 2e6 - kByteTimeUs * static_cast<double>(second.size()));
}

}  // namespace
}  // namespace ignis::l1
