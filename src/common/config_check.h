// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <format>
#include <stdexcept>

#include "common/config_fields.h"

namespace ignis::config {

/// A configuration that cannot be used. what() names every offence: field, value, allowed range.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(const Offences& offences);
  explicit ConfigError(const std::string& message) : std::runtime_error(message) {}
};

/// One line per offence, as ConfigError prints it.
[[nodiscard]] std::string describe(const Offences& offences);

/// The rule texts, shared by the loader and the validator so that both say the same.
[[nodiscard]] std::string allowed_text(Range range, std::string_view unit);
[[nodiscard]] std::string allowed_text(IntRange range, std::string_view unit);
[[nodiscard]] std::string allowed_text(std::initializer_list<std::string_view> choices);

/// Visitor that compares every value with its allowed range and collects what is outside.
class Validator {
 public:
  explicit Validator(Offences& offences, std::string path = "") : offences_(offences), path_(std::move(path)) {}

  void number(std::string_view name, const double& value, Range range, std::string_view unit, std::string_view) {
    if (!(value >= range.min && value <= range.max)) refuse(name, std::format("{}", value), allowed_text(range, unit));
  }
  void integer(std::string_view name, const int& value, IntRange range, std::string_view unit, std::string_view) {
    if (value < range.min || value > range.max) refuse(name, std::format("{}", value), allowed_text(range, unit));
  }
  void flag(std::string_view, const bool&, std::string_view) {}
  void text(std::string_view, const std::string&, std::string_view) {}
  void choice(std::string_view name, const std::string& value, std::initializer_list<std::string_view> allowed,
              std::string_view) {
    if (std::ranges::find(allowed, value) == allowed.end()) refuse(name, '"' + value + '"', allowed_text(allowed));
  }
  void vector(std::string_view name, const std::array<double, 3>& value, Range range, std::string_view unit,
              std::string_view) {
    const bool inside = std::ranges::all_of(value, [&](double v) { return v >= range.min && v <= range.max; });
    if (!inside) refuse(name, std::format("[{}, {}, {}]", value[0], value[1], value[2]), allowed_text(range, unit));
  }
  template <class Section>
  void section(std::string_view name, const Section& value, std::string_view) {
    Validator(offences_, join(name)).visit(value);
  }
  template <class Item>
  void list(std::string_view name, const std::vector<Item>& items, int max_items, std::string_view) {
    if (std::ssize(items) > max_items) {
      refuse(name, std::format("{} entries", items.size()), std::format("at most {} entries", max_items));
    }
    for (std::size_t i = 0; i < items.size(); ++i) {
      Validator(offences_, std::format("{}[{}]", join(name), i)).visit(items[i]);
    }
  }

  /// Visits all fields of a struct, then its own rule across fields, if it has one.
  template <class Section>
  void visit(const Section& value) {
    value.visit_fields(*this);
    if constexpr (requires { value.check(offences_, path_); }) value.check(offences_, path_);
  }

 private:
  void refuse(std::string_view name, std::string value, std::string allowed) {
    offences_.push_back({join(name), std::move(value), std::move(allowed)});
  }
  [[nodiscard]] std::string join(std::string_view name) const {
    return path_.empty() ? std::string(name) : path_ + '.' + std::string(name);
  }

  Offences& offences_;
  std::string path_;
};

/// Throws ConfigError with every offence of `value`. Each core calls this in its constructor.
template <class Section>
void require_valid(const Section& value, const std::string& path = "") {
  Offences offences;
  Validator(offences, path).visit(value);
  if (!offences.empty()) throw ConfigError(offences);
}

}  // namespace ignis::config
