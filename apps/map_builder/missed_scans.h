// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/keyframe.h"
#include "messages/odometry_messages.h"

namespace ignis {

/// What a map is built of, as it came over the bus.
using MapInput = std::variant<messages::PosedCloud, Keyframe>;

/// Closes the gap between what a killed map had and what its successor hears: clouds are sent once, and each belongs
/// to the keyframe before it. So everything is held back until the clouds in between, asked for from the front end by
/// their running numbers, have come; then it goes on in the order in which it was made. A cloud that is sent again
/// follows its keyframe, if it has one. Times are [s] of any steady clock.
class MissedScans {
 public:
  /// [s] after which clouds that have not come are asked for again.
  static constexpr double kAskAgain_s = 0.3;

  /// [s] without one of them after which the rest is given up.
  static constexpr double kGiveUp_s = 2.0;

  /// Points held back at most: 64 MB.
  static constexpr std::size_t kMostPoints = 4'000'000;

  /// Messages asked for at once; together they must find room in the receive buffer of the bus.
  static constexpr int kPartsAtOnce = 24;

  /// [s] for which trouble() tells what was given up.
  static constexpr double kTold_s = 60.0;

  /// A map whose newest cloud has the number `newest` hears `first` as the first one. Where that is no later number the
  /// front end was started anew as well, and counts anew: nothing can be asked for.
  void begin(std::int32_t newest, std::int32_t first, double now_s);

  /// Whether everything that arrives has to be held back.
  [[nodiscard]] bool waiting() const { return newest_.has_value(); }

  /// A cloud of LIO_CLOUD. One before the newest says that the front end was started anew meanwhile and has forgotten
  /// what is asked for: the wait ends.
  void hold(const messages::PosedCloud& cloud, double now_s);

  /// A cloud of LIO_CLOUD_AGAIN, which somebody else may have asked for.
  void hold_again(const messages::PosedCloud& cloud, double now_s);

  void hold(const Keyframe& keyframe);

  /// Numbers of the clouds to ask for now, the newest first: the oldest go first at the front end. Often empty.
  [[nodiscard]] std::vector<std::int32_t> ask(double now_s);

  /// Once nothing is missing, or is given up: everything held back, in the order in which it was made. Else nothing.
  [[nodiscard]] std::vector<MapInput> take(double now_s);

  /// What is waited for, or was given up lately, for people; empty otherwise.
  [[nodiscard]] std::string trouble(double now_s) const;

 private:
  [[nodiscard]] std::int64_t missing_count() const;
  [[nodiscard]] std::vector<std::int32_t> newest_missing(std::size_t most) const;
  [[nodiscard]] bool has(std::int32_t number) const;
  void give_up(const std::string& what, double now_s);

  std::optional<std::int32_t> newest_;  // number of the map's newest cloud, while the gap is open
  bool newest_came_again_ = false;      // and so did the keyframe that was made of it, if there is one
  std::map<std::int32_t, messages::PosedCloud> clouds_;
  std::map<std::int32_t, Keyframe> keyframes_;
  std::vector<messages::PosedCloud> counted_anew_;
  std::size_t points_ = 0;
  std::vector<std::int32_t> asked_;
  double asked_s_ = 0.0;
  double progress_s_ = 0.0;
  std::string given_up_;
  double given_up_s_ = 0.0;
};

}  // namespace ignis
