// SPDX-License-Identifier: Apache-2.0
#include "drivers/frame_parser.h"

#include <algorithm>

namespace ignis::l1 {

namespace {

/// A gap between two reads this long cannot have been filled with line time alone; keeps bounds from running away when
/// one huge read (a capture, a stalled host) is fed at once.
constexpr double kMostLineTimeUs = 50'000.0;

unsigned at(std::span<const std::byte> bytes, std::size_t index) { return std::to_integer<unsigned>(bytes[index]); }

}  // namespace

void FrameParser::feed(std::span<const std::byte> bytes, Utime arrival) {
  if (bytes.empty()) return;
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
  begin_ = 0;
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  counters_.bytes += std::ssize(bytes);
  reads_.push_back({counters_.bytes, arrival});
}

std::optional<Frame> FrameParser::next() {
  for (;;) {
    skip_to_next_magic();
    const auto bytes = unread();
    if (bytes.empty() || (bytes.size() < kHeaderSize && !finished_)) return std::nullopt;
    const auto header = bytes.size() < kHeaderSize ? std::nullopt : plausible_header(bytes);
    if (!header) {
      reject_magic();
      continue;
    }
    if (bytes.size() < header->frame_size()) {
      if (!finished_) return std::nullopt;
      reject_magic();
      continue;
    }
    if (!checksum_passes(bytes, *header)) {
      ++counters_.crc_errors;
      reject_magic();
      continue;
    }
    if (searching_) ++counters_.resyncs;
    searching_ = false;
    ++counters_.frames;
    if (header->is_signed) {
      ++counters_.signed_frames;
      consume(header->frame_size());
      continue;
    }
    const auto payload = bytes.subspan(kHeaderSize, header->length);
    Frame frame{.id = header->id,
                .sequence = std::to_integer<std::uint8_t>(bytes[4]),
                .payload = Payload(payload.begin(), payload.end()),
                .sent_before = sent_before(header->frame_size())};
    consume(header->frame_size());
    return frame;
  }
}

std::optional<FrameParser::Header> FrameParser::plausible_header(std::span<const std::byte> bytes) {
  // The checksum needs the definition of the message: an id outside the dialect cannot be a frame we can trust.
  const unsigned incompatible_flags = at(bytes, 2);
  const std::uint32_t id = at(bytes, 7) | at(bytes, 8) << 8U | at(bytes, 9) << 16U;
  const auto info = message_info(id);
  const std::size_t length = at(bytes, 1);
  if (incompatible_flags > 1 || !info || length == 0 || length > info->length) return std::nullopt;
  return Header{id, length, info->crc_extra, incompatible_flags == 1};
}

bool FrameParser::checksum_passes(std::span<const std::byte> bytes, const Header& header) {
  const std::size_t end = kHeaderSize + header.length;
  const std::byte extra[] = {std::byte{header.crc_extra}};
  const std::uint16_t crc = crc16(extra, crc16(bytes.subspan(1, end - 1)));
  return crc == (at(bytes, end) | at(bytes, end + 1) << 8U);
}

double FrameParser::sent_before(std::size_t frame_size) const {
  const std::int64_t frame_end = consumed_ + static_cast<std::int64_t>(frame_size);
  const auto read = std::ranges::find_if(reads_, [&](const Read& each) { return each.end >= frame_end; });
  const double line_time_after = static_cast<double>(read->end - frame_end) * kByteTimeUs;
  return static_cast<double>(read->arrival) - std::min(line_time_after, kMostLineTimeUs) -
         static_cast<double>(frame_size) * kByteTimeUs;
}

void FrameParser::skip_to_next_magic() {
  const auto bytes = unread();
  const auto magic = std::ranges::find(bytes, kMagic);
  const auto skipped = static_cast<std::size_t>(magic - bytes.begin());
  if (skipped == 0) return;
  counters_.skipped_bytes += static_cast<std::int64_t>(skipped);
  searching_ = true;
  consume(skipped);
}

void FrameParser::reject_magic() {
  ++counters_.skipped_bytes;
  searching_ = true;
  consume(1);
}

void FrameParser::consume(std::size_t count) {
  begin_ += count;
  consumed_ += static_cast<std::int64_t>(count);
  while (!reads_.empty() && reads_.front().end <= consumed_) reads_.pop_front();
}

}  // namespace ignis::l1
