// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

/// One definition per parameter. A configuration struct keeps its defaults in its members and lists the members once,
/// in `void visit_fields(this auto& self, auto& visit)`. Visitors turn that list into a strict loader, a validator, a
/// printer and a JSON schema (config_check.h, config_json.h), so the four can never disagree.
///
/// A visitor offers
///   number(name, double&, Range, unit, doc)          integer(name, int&, IntRange, unit, doc)
///   flag(name, bool&, doc)                           text(name, std::string&, doc)
///   choice(name, std::string&, {allowed...}, doc)    vector(name, std::array<double, 3>&, Range, unit, doc)
///   section(name, sub-struct&, doc)                  list(name, std::vector<sub-struct>&, max_items, doc)
/// A struct may add `void check(Offences&, const std::string& path) const` for rules across several fields.
namespace ignis::config {

/// Closed interval of a real parameter, in the unit of the field.
struct Range {
  double min;
  double max;
};

/// Closed interval of a whole-number parameter.
struct IntRange {
  int min;
  int max;
};

/// One thing that is wrong with a configuration.
struct Offence {
  std::string field;    ///< path such as "frontend.voxel_size_m"
  std::string value;    ///< as found
  std::string allowed;  ///< what would have been right
};

using Offences = std::vector<Offence>;

}  // namespace ignis::config
