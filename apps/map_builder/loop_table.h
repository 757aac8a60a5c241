// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "ignis/loop_result_t.hpp"

namespace ignis {

/// The newest word on every loop of the session. Loops in the graph stay; of the others the newest kMaxOutside.
class LoopTable {
 public:
  static constexpr std::size_t kMaxOutside = 50;

  /// True when the table has changed.
  bool record(const loop_result_t& result);
  void clear() { loops_.clear(); }

  [[nodiscard]] bool contains(std::int32_t from_id, std::int32_t to_id) const {
    return loops_.contains({from_id, to_id});
  }
  [[nodiscard]] std::size_t size() const { return loops_.size(); }

  /// The text {"type": "loops", ...} of docs/wire_format.md, oldest first.
  [[nodiscard]] std::string text() const;

 private:
  struct Loop {
    std::int64_t order = 0;  // of the first word on it
    loop_result_t newest;
  };

  void drop_oldest_outside();

  std::map<std::pair<std::int32_t, std::int32_t>, Loop> loops_;
  std::int64_t next_order_ = 0;
};

/// True when the loop's factor is in the graph at this stage.
[[nodiscard]] bool is_in_graph(std::int8_t stage);

/// Name of a stage as the stream has it.
[[nodiscard]] const char* stage_name(std::int8_t stage);

}  // namespace ignis
