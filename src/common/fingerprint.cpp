// SPDX-License-Identifier: Apache-2.0
#include "common/fingerprint.h"

#include <format>

namespace ignis {
namespace {

constexpr std::uint64_t kFnvPrime = 0x100000001b3ULL;

}  // namespace

void Fingerprint::add(std::string_view bytes) {
  for (const char byte : bytes) hash_ = (hash_ ^ static_cast<unsigned char>(byte)) * kFnvPrime;
}

void Fingerprint::add(std::int64_t value) {
  for (int shift = 0; shift < 64; shift += 8) {
    hash_ = (hash_ ^ ((static_cast<std::uint64_t>(value) >> shift) & 0xffU)) * kFnvPrime;
  }
}

std::string Fingerprint::text() const { return std::format("{:016x}", hash_); }

}  // namespace ignis
