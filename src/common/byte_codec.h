// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

/// Values to bytes and back, by one list of fields for both directions: a function `transfer(io, value)` per struct,
/// called with a ByteWriter and a constant value or with a ByteReader and one to fill. Little-endian, no padding.
namespace ignis {

static_assert(std::endian::native == std::endian::little, "files are little-endian, and so are amd64 and arm64");

template <class T, class Struct>
concept FieldsOf = std::same_as<std::remove_const_t<T>, Struct>;

template <class T>
concept Number = std::is_arithmetic_v<std::remove_const_t<T>> || std::is_enum_v<std::remove_const_t<T>>;

void transfer(auto& io, Number auto& value) { io.number(value); }

/// Appends.
class ByteWriter {
 public:
  explicit ByteWriter(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  void number(const Number auto& value) { raw(&value, sizeof value); }
  void number_below(const std::unsigned_integral auto& value, std::uint64_t /*end*/) { number(value); }
  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size()));
    raw(value.data(), value.size());
  }
  template <class Derived>
  void matrix(const Eigen::PlainObjectBase<Derived>& value) {
    if constexpr (Derived::RowsAtCompileTime == Eigen::Dynamic) number(static_cast<std::uint32_t>(value.rows()));
    raw(value.data(), sizeof(typename Derived::Scalar) * static_cast<std::size_t>(value.size()));
  }
  /// A vector or a deque.
  template <class List>
  void list(const List& values) {
    number(static_cast<std::uint32_t>(values.size()));
    for (const auto& value : values) transfer(*this, value);
  }
  template <class Value>
  void maybe(const std::optional<Value>& value) {
    number(static_cast<std::uint8_t>(value.has_value()));
    if (value) transfer(*this, *value);
  }

 private:
  void raw(const void* data, std::size_t size) {
    const auto* begin = static_cast<const std::byte*>(data);
    bytes_.insert(bytes_.end(), begin, begin + size);
  }

  std::vector<std::byte>& bytes_;
};

/// Takes from the front. Never reads beyond the end and never allocates more than a small multiple of what is there:
/// once something is missing or impossible, failed() is true and every further value is left as it was.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] bool at_end() const { return bytes_.empty(); }

  void number(Number auto& value) {
    if constexpr (std::same_as<decltype(value), bool&>) {
      std::uint8_t byte = 0;
      raw(&byte, sizeof byte);
      if (byte > 1) failed_ = true;
      value = byte == 1;
    } else {
      raw(&value, sizeof value);
    }
  }
  /// One that is used as an index: from `end` on it is impossible, and 0.
  void number_below(std::unsigned_integral auto& value, std::uint64_t end) {
    number(value);
    if (value < end) return;
    failed_ = true;
    value = 0;
  }
  void text(std::string& value) {
    const std::size_t size = count(1);
    value.resize(size);
    raw(value.data(), size);
  }
  template <class Derived>
  void matrix(Eigen::PlainObjectBase<Derived>& value) {
    constexpr std::size_t kScalar = sizeof(typename Derived::Scalar);
    if constexpr (Derived::RowsAtCompileTime == Eigen::Dynamic) {
      value.resize(static_cast<Eigen::Index>(count(kScalar * Derived::ColsAtCompileTime)), Derived::ColsAtCompileTime);
    }
    raw(value.data(), kScalar * static_cast<std::size_t>(value.size()));
  }
  template <class List>
  void list(List& values) {
    const std::size_t size = count(1);
    values.clear();
    for (std::size_t i = 0; i < size && !failed_; ++i) transfer(*this, values.emplace_back());
  }
  template <class Value>
  void maybe(std::optional<Value>& value) {
    bool is_there = false;
    number(is_there);
    if (is_there && !failed_) transfer(*this, value.emplace());
  }

 private:
  /// A count of elements of at least `bytes_each`; 0 when so many cannot follow.
  std::size_t count(std::size_t bytes_each) {
    std::uint32_t size = 0;
    number(size);
    if (failed_ || size > bytes_.size() / bytes_each) {
      failed_ = true;
      return 0;
    }
    return size;
  }

  void raw(void* data, std::size_t size) {
    if (failed_ || size > bytes_.size()) {
      failed_ = true;
      return;
    }
    if (size > 0) std::memcpy(data, bytes_.data(), size);
    bytes_ = bytes_.subspan(size);
  }

  std::span<const std::byte> bytes_;
  bool failed_ = false;
};

/// All of a value whose `transfer` stands in its own namespace.
template <class Value>
[[nodiscard]] std::vector<std::byte> to_bytes(const Value& value, std::size_t expected = 0) {
  std::vector<std::byte> bytes;
  bytes.reserve(expected);
  ByteWriter writer(bytes);
  transfer(writer, value);
  return bytes;
}

/// The value that these bytes are, with none missing and none left over. Any bytes at all.
template <class Value>
[[nodiscard]] std::optional<Value> from_bytes(std::span<const std::byte> bytes) {
  std::optional<Value> value(std::in_place);
  ByteReader reader(bytes);
  transfer(reader, *value);
  if (reader.failed() || !reader.at_end()) value.reset();
  return value;
}

}  // namespace ignis
