// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "common/time.h"
#include "drivers/mavlink_frame.h"

namespace ignis::l1 {

/// A frame whose checksum passed.
struct Frame {
  std::uint32_t id = 0;
  std::uint8_t sequence = 0;
  Payload payload;
  /// [us] latest instant at which the sensor can have begun to send it: arrival of the read that completed it, less
  /// the line time of its own bytes and of the bytes that followed it in that read.
  double sent_before = 0.0;
};

struct FrameCounters {
  std::int64_t bytes = 0;          ///< fed
  std::int64_t frames = 0;         ///< checksum passed, signed ones included
  std::int64_t crc_errors = 0;     ///< plausible header, wrong checksum
  std::int64_t signed_frames = 0;  ///< valid but signed: skipped, the L1 does not sign
  std::int64_t skipped_bytes = 0;  ///< outside any frame
  std::int64_t resyncs = 0;        ///< searches for the start of a frame that had to skip something
};

/// Cuts a byte stream into frames. After a false start it resumes at the byte after the false magic, so that damage
/// costs the damaged frame only. Accepts any sender, trimmed and untrimmed payloads.
class FrameParser {
 public:
  /// Appends the bytes of one read; `arrival` [us] is the instant at which that read returned.
  void feed(std::span<const std::byte> bytes, Utime arrival);

  /// The next whole frame, or nothing until more bytes come.
  [[nodiscard]] std::optional<Frame> next();

  /// The stream is over: what waits for more bytes of a frame is a false start, so that frames behind it come out.
  void finish() { finished_ = true; }

  [[nodiscard]] const FrameCounters& counters() const { return counters_; }

 private:
  struct Read {
    std::int64_t end;  ///< stream offset after its last byte
    Utime arrival;
  };
  struct Header {
    std::uint32_t id;
    std::size_t length;
    std::uint8_t crc_extra;
    bool is_signed;
    [[nodiscard]] std::size_t frame_size() const {
      return kHeaderSize + length + kChecksumSize + (is_signed ? kSignatureSize : 0);
    }
  };

  [[nodiscard]] std::span<const std::byte> unread() const { return std::span(buffer_).subspan(begin_); }
  [[nodiscard]] static std::optional<Header> plausible_header(std::span<const std::byte> bytes);
  [[nodiscard]] static bool checksum_passes(std::span<const std::byte> bytes, const Header& header);
  [[nodiscard]] double sent_before(std::size_t frame_size) const;
  void skip_to_next_magic();
  void reject_magic();
  void consume(std::size_t count);

  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0;      ///< index in buffer_ of the first byte not yet consumed
  std::int64_t consumed_ = 0;  ///< stream offset of that byte
  bool finished_ = false;
  bool searching_ = false;  ///< between a false start and the next valid frame
  std::deque<Read> reads_;
  FrameCounters counters_;
};

}  // namespace ignis::l1
