// SPDX-License-Identifier: Apache-2.0
#include "common/config_json.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <numeric>
#include <ranges>
#include <string_view>

namespace ignis::config {
namespace {

constexpr int kMaxDepth = 16;

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row.back();
}

/// The parser's complaint quotes the bytes that it stumbled over; a message for people is text.
std::string readable(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const bool is_plain = c >= ' ' && c <= '~';
    result += is_plain ? std::string(1, c) : std::format("<{:02X}>", static_cast<unsigned char>(c));
  }
  return result;
}

/// As the parser counts them in its own complaints: lines from 1, columns up to the last character that was read.
std::string place_of(const std::string& text, const char* last) {
  const std::string_view before(text.data(), last);
  const auto line = 1 + std::ranges::count(before, '\n');
  const std::size_t line_begin = before.rfind('\n') + 1;  // 0 in the first line
  return std::format("line {}, column {}", line, before.size() - line_begin + 1);
}

}  // namespace

Json parse_json(const std::string& text, const std::string& source) {
  std::vector<std::set<std::string>> open_objects;
  std::string fault;
  const char* newest = text.data();  // that the parser has read
  const auto refuse = [&](const std::string& reason) {
    if (fault.empty()) fault = std::format("{}: {}", place_of(text, newest), reason);
  };
  const auto watch = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (depth > kMaxDepth) refuse(std::format("nesting deeper than {}", kMaxDepth));
    if (event == Json::parse_event_t::object_start) open_objects.emplace_back();
    if (event == Json::parse_event_t::object_end) open_objects.pop_back();
    if (event == Json::parse_event_t::key && !open_objects.back().insert(parsed.get<std::string>()).second) {
      refuse(std::format("the key \"{}\" stands twice", parsed.get<std::string>()));
    }
    return fault.empty();
  };
  Json json;
  try {
    const auto noted = text | std::views::transform([&](const char& c) {
                         newest = &c;
                         return c;
                       });
    json = Json::parse(noted.begin(), noted.end(), watch);
  } catch (const Json::exception& error) {
    // What the callback refused is the cause; the parser's own complaint may only be its consequence.
    if (fault.empty()) fault = std::format("not valid JSON: {}", readable(error.what()));
  }
  if (!fault.empty()) throw ConfigError(std::format("{}: {}", source, fault));
  if (!json.is_object()) throw ConfigError(std::format("{}: the outermost value must be an object", source));
  return json;
}

Json read_json(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) throw ConfigError(std::format("{}: no such file", file.string()));
  if (std::filesystem::is_directory(file, error)) throw ConfigError(std::format("{}: is a folder", file.string()));
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw ConfigError(std::format("{}: cannot be read", file.string()));
  return parse_json({std::istreambuf_iterator<char>(stream), {}}, file.string());
}

void assign(Json& object, const std::string& assignment, Offences& offences) {
  const std::size_t equals = assignment.find('=');
  const std::string path = assignment.substr(0, equals);
  const std::string value = equals == std::string::npos ? "" : assignment.substr(equals + 1);
  Json* place = &object;
  std::size_t begin = 0;
  bool valid = equals != std::string::npos && !value.empty();
  while (valid) {
    const std::size_t dot = path.find('.', begin);
    const std::string key = path.substr(begin, dot - begin);
    valid = !key.empty() && place->is_object();
    if (!valid) break;
    place = &(*place)[key];
    if (dot == std::string::npos) break;
    if (place->is_null()) *place = Json::object();
    begin = dot + 1;
  }
  if (!valid) {
    offences.push_back({"--set", assignment, "section.key=value"});
    return;
  }
  Json parsed = Json::parse(value, nullptr, false);
  *place = parsed.is_discarded() ? Json(value) : std::move(parsed);
}

std::string nearest_word(const std::string& word, const std::set<std::string>& known) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : known) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

void Loader::refuse_unknown_keys() {
  for (const auto& [key, value] : object_.items()) {
    // "$schema" is how editors find the schema; it configures nothing.
    if (known_.contains(key) || (path_.empty() && key == "$schema")) continue;
    const std::string near = nearest_word(key, known_);
    offences_.push_back({join(key), value.dump(),
                         near.empty() ? "no such key" : std::format("no such key; did you mean \"{}\"?", near)});
  }
}

}  // namespace ignis::config
