// SPDX-License-Identifier: Apache-2.0
#include "messages/length_check.h"

#include <optional>

namespace ignis::messages {
namespace {

/// Walks over an encoded body; 64-bit arithmetic, so no announced count can wrap.
class Cursor {
 public:
  explicit Cursor(std::span<const std::byte> body) : body_(body) {}

  [[nodiscard]] bool skip(std::int64_t bytes) {
    if (bytes < 0 || bytes > remaining()) return false;
    position_ += bytes;
    return true;
  }

  [[nodiscard]] std::optional<std::int32_t> read_int32() {
    const std::int64_t at = position_;
    if (!skip(4)) return std::nullopt;
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value = (value << 8) | std::to_integer<std::uint32_t>(body_[at + i]);
    return static_cast<std::int32_t>(value);
  }

  [[nodiscard]] bool skip_string() {
    const std::optional<std::int32_t> length = read_int32();
    if (!length || *length < 1 || !skip(*length)) return false;
    return body_[position_ - 1] == std::byte{0};
  }

  [[nodiscard]] bool at_end() const { return remaining() == 0; }

 private:
  [[nodiscard]] std::int64_t remaining() const { return std::ssize(body_) - position_; }

  std::span<const std::byte> body_;
  std::int64_t position_ = 0;
};

bool walk(const LayoutStep& step, Cursor& cursor, std::int64_t& count) {
  switch (step.kind) {
    case LayoutStep::kFixed:
      return cursor.skip(step.bytes);
    case LayoutStep::kString:
      return cursor.skip_string();
    case LayoutStep::kCount: {
      const std::optional<std::int32_t> value = cursor.read_int32();
      if (!value || *value < 0) return false;
      count = *value;
      return true;
    }
    case LayoutStep::kArray:
      return cursor.skip(count * step.bytes);
    case LayoutStep::kStrings:
      for (std::int64_t i = 0; i < count; ++i) {
        if (!cursor.skip_string()) return false;
      }
      return true;
  }
  return false;
}

}  // namespace

bool length_is_consistent(std::span<const LayoutStep> layout, std::span<const std::byte> body) {
  Cursor cursor(body);
  std::int64_t count = 0;
  for (const LayoutStep& step : layout) {
    if (!walk(step, cursor, count)) return false;
  }
  return cursor.at_end();
}

}  // namespace ignis::messages
