// SPDX-License-Identifier: Apache-2.0
#include "runtime/refusals.h"

#include <bit>
#include <format>

#include "messages/type_name.h"

namespace ignis::runtime {

std::string Refusals::foreign_type(std::span<const std::byte> data, std::int64_t expected) {
  const std::uint64_t found = messages::fingerprint_of(data);
  if (found == static_cast<std::uint64_t>(expected)) return {};
  return std::format("{} instead of {}", messages::type_name(found),
                     messages::type_name(static_cast<std::uint64_t>(expected)));
}

bool Refusals::refused(const std::string& reason, bool is_foreign, double now_s) {
  ++count_;
  reason_ = reason;
  is_foreign_ = is_foreign;
  last_refused_s_ = now_s;
  return std::has_single_bit(static_cast<std::uint64_t>(count_));
}

std::string Refusals::trouble(double now_s) const {
  if (count_ == 0 || now_s - last_refused_s_ > kTold_s) return {};
  return std::format("refused {} messages, the last one: {}", count_, reason_);
}

bool Refusals::is_taken_by_another(double now_s) const {
  return is_foreign_ && !trouble(now_s).empty() && now_s - last_taken_s_ > kTold_s;
}

}  // namespace ignis::runtime
