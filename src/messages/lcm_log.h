// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

namespace ignis::messages {

/// One record of an LCM log. The views point into the log and live as long as it.
struct LogEvent {
  std::int64_t number = 0;     ///< running number of the writer
  std::int64_t log_utime = 0;  ///< [us] instant of recording; measurements carry their own
  std::string_view channel;
  std::span<const std::byte> data;
};

/// Reads LCM event logs and survives damage: LCM's own reader ends silently at the first bad byte and trusts announced
/// lengths. A record is a 28-byte big-endian head (sync word 0xEDA1DA01, int64 number, int64 time, int32 channel
/// length, int32 data length), the channel and the data. After damage the search goes on at the next plausible head.
class LcmLog {
 public:
  /// Maps the file. Throws std::runtime_error that says what is wrong (missing, a folder, empty, no LCM log).
  explicit LcmLog(const std::filesystem::path& file);
  ~LcmLog();
  LcmLog(LcmLog&&) noexcept;
  LcmLog& operator=(LcmLog&&) noexcept;

  /// The next whole record, or nothing at the end.
  [[nodiscard]] std::optional<LogEvent> next();

  /// Gives back the memory of what has been read; what is read again comes from the disk again. Views stay valid.
  void release_memory() const;

  [[nodiscard]] std::int64_t size_bytes() const;
  [[nodiscard]] std::int64_t position() const;

  /// Bytes that belong to no whole record, so far. Not 0 means that input was lost.
  [[nodiscard]] std::int64_t damaged_bytes() const;

 private:
  struct Mapping;
  std::unique_ptr<Mapping> mapping_;
  std::int64_t position_ = 0;
  std::int64_t damaged_bytes_ = 0;
};

}  // namespace ignis::messages
