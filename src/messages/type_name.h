// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace ignis::messages {

/// The first eight bytes of an encoded message, which stand for its type and version; 0 when there are fewer.
[[nodiscard]] std::uint64_t fingerprint_of(std::span<const std::byte> data);

/// Name of one of our types by its fingerprint, else the fingerprint in words.
[[nodiscard]] std::string type_name(std::uint64_t fingerprint);

}  // namespace ignis::messages
