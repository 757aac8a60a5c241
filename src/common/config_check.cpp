// SPDX-License-Identifier: Apache-2.0
#include "common/config_check.h"

namespace ignis::config {

std::string describe(const Offences& offences) {
  std::string text = std::format("{} in the configuration:",
                                 offences.size() == 1 ? "one fault" : std::format("{} faults", offences.size()));
  for (const Offence& offence : offences) {
    text += std::format("\n  {} = {}: allowed is {}", offence.field, offence.value, offence.allowed);
  }
  return text;
}

ConfigError::ConfigError(const Offences& offences) : std::runtime_error(describe(offences)) {}

std::string allowed_text(Range range, std::string_view unit) {
  return std::format("{} to {} [{}]", range.min, range.max, unit);
}

std::string allowed_text(IntRange range, std::string_view unit) {
  return std::format("a whole number from {} to {} [{}]", range.min, range.max, unit);
}

std::string allowed_text(std::initializer_list<std::string_view> choices) {
  std::string text = "one of";
  for (std::string_view choice : choices) text += std::format(" \"{}\"", choice);
  return text;
}

}  // namespace ignis::config
