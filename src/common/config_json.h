// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <set>

#include <nlohmann/json.hpp>

#include "common/config_check.h"

/// JSON in and out of configuration structs: strict loading, printing, and the JSON schema.
namespace ignis::config {

using Json = nlohmann::ordered_json;

/// Parses a JSON text. Refuses doubled keys, nesting deeper than 16 and anything that is not one object.
/// Throws ConfigError that names `source`, line and column.
[[nodiscard]] Json parse_json(const std::string& text, const std::string& source);

/// Reads and parses a file. Throws ConfigError when it is missing, a folder, unreadable or not JSON.
[[nodiscard]] Json read_json(const std::filesystem::path& file);

/// Sets one value of a nested object from an assignment "section.key=value"; sections that are missing are made. The
/// value is read as JSON, and as a text where it is none. Anything that is no assignment becomes an offence.
void assign(Json& object, const std::string& assignment, Offences& offences);

/// The entry of `known` that is nearest to `word` by edit distance, or an empty text when none is near.
[[nodiscard]] std::string nearest_word(const std::string& word, const std::set<std::string>& known);

/// Visitor that copies values from a JSON object into a struct. What is absent keeps its default. Unknown keys, wrong
/// types and fractions where whole numbers belong become offences; ranges are the Validator's business.
class Loader {
 public:
  Loader(const Json& object, Offences& offences, std::string path = "")
      : object_(object), offences_(offences), path_(std::move(path)) {}

  void number(std::string_view name, double& value, Range range, std::string_view unit, std::string_view) {
    const Json* found = find(name);
    if (found == nullptr) return;
    if (found->is_number()) {
      value = found->get<double>();
    } else {
      refuse(name, *found, allowed_text(range, unit));
    }
  }
  void integer(std::string_view name, int& value, IntRange range, std::string_view unit, std::string_view) {
    const Json* found = find(name);
    if (found == nullptr) return;
    // Unsigned values above the signed range would wrap in a plain get<>.
    const bool fits = found->is_number_integer() &&
                      !(found->is_number_unsigned() &&
                        found->get<std::uint64_t>() > static_cast<std::uint64_t>(std::numeric_limits<int>::max())) &&
                      found->get<std::int64_t>() >= std::numeric_limits<int>::min();
    if (fits) {
      value = found->get<int>();
    } else {
      refuse(name, *found, allowed_text(range, unit));
    }
  }
  void flag(std::string_view name, bool& value, std::string_view) {
    const Json* found = find(name);
    if (found == nullptr) return;
    if (found->is_boolean()) {
      value = found->get<bool>();
    } else {
      refuse(name, *found, "true or false");
    }
  }
  void text(std::string_view name, std::string& value, std::string_view) {
    const Json* found = find(name);
    if (found == nullptr) return;
    if (found->is_string()) {
      value = found->get<std::string>();
    } else {
      refuse(name, *found, "a text");
    }
  }
  void choice(std::string_view name, std::string& value, std::initializer_list<std::string_view> allowed,
              std::string_view) {
    const Json* found = find(name);
    if (found == nullptr) return;
    if (found->is_string()) {
      value = found->get<std::string>();
    } else {
      refuse(name, *found, allowed_text(allowed));
    }
  }
  void vector(std::string_view name, std::array<double, 3>& value, Range range, std::string_view unit,
              std::string_view) {
    const Json* found = find(name);
    if (found == nullptr) return;
    const bool fits = found->is_array() && found->size() == 3 &&
                      std::ranges::all_of(*found, [](const Json& item) { return item.is_number(); });
    if (fits) {
      for (std::size_t i = 0; i < 3; ++i) value[i] = (*found)[i].get<double>();
    } else {
      refuse(name, *found, "three numbers, each " + allowed_text(range, unit));
    }
  }
  template <class Section>
  void section(std::string_view name, Section& value, std::string_view) {
    const Json* found = find(name);
    if (found == nullptr) return;
    if (found->is_object()) {
      Loader(*found, offences_, join(name)).visit(value);
    } else {
      refuse(name, *found, "an object");
    }
  }
  template <class Item>
  void list(std::string_view name, std::vector<Item>& items, int, std::string_view) {
    const Json* found = find(name);
    if (found == nullptr) return;
    if (!found->is_array()) return refuse(name, *found, "a list");
    items.clear();
    for (std::size_t i = 0; i < found->size(); ++i) {
      const std::string path = std::format("{}[{}]", join(name), i);
      if (!(*found)[i].is_object()) {
        offences_.push_back({path, (*found)[i].dump(), "an object"});
        continue;
      }
      Loader((*found)[i], offences_, path).visit(items.emplace_back());
    }
  }

  /// Loads every field, then refuses the keys that no field asked for.
  template <class Section>
  void visit(Section& value) {
    value.visit_fields(*this);
    refuse_unknown_keys();
  }

 private:
  const Json* find(std::string_view name) {
    known_.emplace(name);
    const auto found = object_.find(name);
    return found == object_.end() ? nullptr : &*found;
  }
  void refuse(std::string_view name, const Json& value, std::string allowed) {
    offences_.push_back({join(name), value.dump(), std::move(allowed)});
  }
  void refuse_unknown_keys();
  [[nodiscard]] std::string join(std::string_view name) const {
    return path_.empty() ? std::string(name) : path_ + '.' + std::string(name);
  }

  const Json& object_;
  Offences& offences_;
  std::string path_;
  std::set<std::string> known_;
};

/// Visitor that writes every value, so that a result can carry exactly what it used.
class Printer {
 public:
  void number(std::string_view name, const double& value, Range, std::string_view, std::string_view) {
    put(name, value);
  }
  void integer(std::string_view name, const int& value, IntRange, std::string_view, std::string_view) {
    put(name, value);
  }
  void flag(std::string_view name, const bool& value, std::string_view) { put(name, value); }
  void text(std::string_view name, const std::string& value, std::string_view) { put(name, value); }
  void choice(std::string_view name, const std::string& value, std::initializer_list<std::string_view>,
              std::string_view) {
    put(name, value);
  }
  void vector(std::string_view name, const std::array<double, 3>& value, Range, std::string_view, std::string_view) {
    put(name, value);
  }
  template <class Section>
  void section(std::string_view name, const Section& value, std::string_view) {
    put(name, print(value));
  }
  template <class Item>
  void list(std::string_view name, const std::vector<Item>& items, int, std::string_view) {
    Json array = Json::array();
    for (const Item& item : items) array.push_back(print(item));
    put(name, array);
  }

  template <class Section>
  [[nodiscard]] static Json print(const Section& value) {
    Printer printer;
    value.visit_fields(printer);
    return printer.json_;
  }

 private:
  void put(std::string_view name, const auto& value) { json_[std::string(name)] = value; }

  Json json_ = Json::object();
};

/// Visitor that writes a JSON schema (draft 2020-12) with default, range, unit and meaning of each key.
class SchemaWriter {
 public:
  void number(std::string_view name, const double& value, Range range, std::string_view unit, std::string_view doc) {
    put(name, {{"type", "number"}, {"minimum", range.min}, {"maximum", range.max}, {"default", value}},
        std::format("{} [{}]", doc, unit));
  }
  void integer(std::string_view name, const int& value, IntRange range, std::string_view unit, std::string_view doc) {
    put(name, {{"type", "integer"}, {"minimum", range.min}, {"maximum", range.max}, {"default", value}},
        std::format("{} [{}]", doc, unit));
  }
  void flag(std::string_view name, const bool& value, std::string_view doc) {
    put(name, {{"type", "boolean"}, {"default", value}}, std::string(doc));
  }
  void text(std::string_view name, const std::string& value, std::string_view doc) {
    put(name, {{"type", "string"}, {"default", value}}, std::string(doc));
  }
  void choice(std::string_view name, const std::string& value, std::initializer_list<std::string_view> allowed,
              std::string_view doc) {
    Json choices = Json::array();
    for (std::string_view item : allowed) choices.push_back(std::string(item));
    put(name, {{"type", "string"}, {"enum", choices}, {"default", value}}, std::string(doc));
  }
  void vector(std::string_view name, const std::array<double, 3>& value, Range range, std::string_view unit,
              std::string_view doc) {
    const Json item = {{"type", "number"}, {"minimum", range.min}, {"maximum", range.max}};
    put(name, {{"type", "array"}, {"items", item}, {"minItems", 3}, {"maxItems", 3}, {"default", value}},
        std::format("{} [{}]", doc, unit));
  }
  template <class Section>
  void section(std::string_view name, const Section& value, std::string_view doc) {
    put(name, schema(value), std::string(doc));
  }
  template <class Item>
  void list(std::string_view name, const std::vector<Item>&, int max_items, std::string_view doc) {
    put(name, {{"type", "array"}, {"items", schema(Item{})}, {"maxItems", max_items}}, std::string(doc));
  }

  template <class Section>
  [[nodiscard]] static Json schema(const Section& value) {
    SchemaWriter writer;
    value.visit_fields(writer);
    return {{"type", "object"}, {"additionalProperties", false}, {"properties", writer.properties_}};
  }

 private:
  void put(std::string_view name, Json schema, std::string description) {
    schema["description"] = std::move(description);
    properties_[std::string(name)] = std::move(schema);
  }

  Json properties_ = Json::object();
};

/// Loads and validates a struct from a JSON object; throws one ConfigError with every offence, those included that were
/// found before.
template <class Section>
[[nodiscard]] Section load(const Json& object, Offences offences = {}) {
  Section value;
  Loader(object, offences).visit(value);
  Validator(offences).visit(value);
  if (!offences.empty()) throw ConfigError(offences);
  return value;
}

}  // namespace ignis::config
