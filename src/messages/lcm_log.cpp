// SPDX-License-Identifier: Apache-2.0
#include "messages/lcm_log.h"

#include <format>
#include <stdexcept>

#include <sys/mman.h>

#include <boost/interprocess/file_mapping.hpp>
#include <boost/interprocess/mapped_region.hpp>

namespace ignis::messages {
namespace {

constexpr std::uint32_t kSyncWord = 0xEDA1DA01U;
constexpr std::int64_t kHeadBytes = 28;
constexpr std::int64_t kMaxChannelLength = 63;  // LCM_MAX_CHANNEL_NAME_LENGTH

std::uint64_t read_big_endian(std::span<const std::byte> bytes, std::int64_t at, int width) {
  std::uint64_t value = 0;
  for (int i = 0; i < width; ++i) value = (value << 8) | std::to_integer<std::uint64_t>(bytes[at + i]);
  return value;
}

std::optional<LogEvent> read_record(std::span<const std::byte> file, std::int64_t at) {
  const std::int64_t available = std::ssize(file) - at;
  if (available < kHeadBytes || read_big_endian(file, at, 4) != kSyncWord) return std::nullopt;
  const auto channel_length = static_cast<std::int32_t>(read_big_endian(file, at + 20, 4));
  const auto data_length = static_cast<std::int32_t>(read_big_endian(file, at + 24, 4));
  if (channel_length < 1 || channel_length > kMaxChannelLength || data_length < 0) return std::nullopt;
  if (kHeadBytes + channel_length + static_cast<std::int64_t>(data_length) > available) return std::nullopt;
  LogEvent event;
  event.number = static_cast<std::int64_t>(read_big_endian(file, at + 4, 8));
  event.log_utime = static_cast<std::int64_t>(read_big_endian(file, at + 12, 8));
  event.channel = {reinterpret_cast<const char*>(file.data() + at + kHeadBytes),
                   static_cast<std::size_t>(channel_length)};
  event.data =
      file.subspan(static_cast<std::size_t>(at + kHeadBytes + channel_length), static_cast<std::size_t>(data_length));
  return event;
}

bool begins_record_or_ends(std::span<const std::byte> file, std::int64_t at) {
  return at == std::ssize(file) || (at + 4 <= std::ssize(file) && read_big_endian(file, at, 4) == kSyncWord);
}

/// True when an altered length made this record span over others: it ends in the middle of nowhere, and a whole record
/// that is followed by another one stands inside of it.
bool swallows_a_record(std::span<const std::byte> file, std::int64_t at, std::int64_t end) {
  if (begins_record_or_ends(file, end)) return false;
  for (std::int64_t inside = at + 4; inside < end; ++inside) {
    const std::optional<LogEvent> event = read_record(file, inside);
    if (!event) continue;
    if (begins_record_or_ends(file, inside + kHeadBytes + std::ssize(event->channel) + std::ssize(event->data))) {
      return true;
    }
  }
  return false;
}

void require_readable(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) throw std::runtime_error(std::format("{}: no such file", file.string()));
  if (!std::filesystem::is_regular_file(file, error)) {
    throw std::runtime_error(std::format("{}: not a file; give the LCM log itself", file.string()));
  }
  if (std::filesystem::file_size(file, error) == 0) {
    throw std::runtime_error(std::format("{}: the log is empty", file.string()));
  }
}

}  // namespace

struct LcmLog::Mapping {
  explicit Mapping(const std::filesystem::path& file)
      : mapping(file.c_str(), boost::interprocess::read_only), region(mapping, boost::interprocess::read_only) {}

  [[nodiscard]] std::span<const std::byte> bytes() const {
    return {static_cast<const std::byte*>(region.get_address()), region.get_size()};
  }

  boost::interprocess::file_mapping mapping;
  boost::interprocess::mapped_region region;
};

LcmLog::LcmLog(const std::filesystem::path& file) {
  require_readable(file);
  try {
    mapping_ = std::make_unique<Mapping>(file);
  } catch (const boost::interprocess::interprocess_exception& error) {
    throw std::runtime_error(std::format("{}: cannot be read: {}", file.string(), error.what()));
  }
  if (!next()) throw std::runtime_error(std::format("{}: holds no LCM record; is it an LCM log?", file.string()));
  position_ = 0;
  damaged_bytes_ = 0;
}

LcmLog::~LcmLog() = default;
LcmLog::LcmLog(LcmLog&&) noexcept = default;
LcmLog& LcmLog::operator=(LcmLog&&) noexcept = default;

std::optional<LogEvent> LcmLog::next() {
  const std::span<const std::byte> file = mapping_->bytes();
  while (position_ < std::ssize(file)) {
    if (std::optional<LogEvent> event = read_record(file, position_)) {
      const std::int64_t end = position_ + kHeadBytes + std::ssize(event->channel) + std::ssize(event->data);
      if (!swallows_a_record(file, position_, end)) {
        position_ = end;
        return event;
      }
    }
    ++position_;
    ++damaged_bytes_;
  }
  return std::nullopt;
}

void LcmLog::release_memory() const {
  // Boost's advise() ends in posix_madvise(), which glibc ignores. A read-only mapping has nothing to lose.
  ::madvise(mapping_->region.get_address(), mapping_->region.get_size(), MADV_DONTNEED);
}

std::int64_t LcmLog::size_bytes() const { return std::ssize(mapping_->bytes()); }
std::int64_t LcmLog::position() const { return position_; }
std::int64_t LcmLog::damaged_bytes() const { return damaged_bytes_; }

}  // namespace ignis::messages
