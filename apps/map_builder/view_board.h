// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "map/map_picture.h"

namespace ignis {

/// A message that several viewers share.
using SharedBytes = std::shared_ptr<const std::string>;

[[nodiscard]] inline SharedBytes shared(std::string bytes) {
  return std::make_shared<const std::string>(std::move(bytes));
}

/// Where the keyframes stand in map [m], ascending ids.
struct KeyframeList {
  struct Entry {
    std::int32_t id = 0;
    Eigen::Vector3f position = Eigen::Vector3f::Zero();
  };
  std::int32_t revision = 0;
  std::vector<Entry> entries;
};
using SharedKeyframes = std::shared_ptr<const KeyframeList>;

/// What the map's thread has to say; what it leaves empty stays as it is.
struct ViewUpdate {
  std::map<double, SharedPicture> pictures;  ///< by view radius [m]; replaces all when not empty
  SharedBytes hud;
  SharedBytes loops;
  SharedBytes api_status;
  SharedKeyframes keyframes;
  std::vector<SharedBytes> events;  ///< appended
  std::optional<std::int32_t> session;
  std::optional<std::int32_t> revision;
};

/// The newest of everything that viewers are told. Nothing is queued per viewer: each remembers what it was sent last
/// and takes, whenever it is ready, what is newest then. Memory is thus bounded by what is on the board, and by what
/// each viewer still refers to: one picture, one list.
class ViewBoard {
 public:
  static constexpr std::size_t kMaxEvents = 200;

  /// What one viewer has been sent.
  struct Seen {
    SharedBytes hud;
    SharedBytes loops;
    SharedKeyframes keyframes;
    std::int64_t events = 0;
    SharedPicture picture;
  };

  /// Takes news over. True when there are new pictures.
  bool apply(ViewUpdate update);

  /// The texts that a viewer has not been sent yet; from now on they count as seen. Oldest kinds first; the HUD last.
  [[nodiscard]] std::vector<SharedBytes> take_texts(Seen& seen) const;

  /// The newest picture of a radius, or nothing yet.
  [[nodiscard]] SharedPicture picture(double radius_m) const;

  [[nodiscard]] const SharedBytes& api_status() const { return api_status_; }
  [[nodiscard]] std::int32_t session() const { return session_; }
  [[nodiscard]] std::int32_t revision() const { return revision_; }

 private:
  SharedBytes hud_;
  SharedBytes loops_;
  SharedBytes api_status_ = std::make_shared<const std::string>("{}");
  SharedKeyframes keyframes_;
  std::deque<SharedBytes> events_;
  std::int64_t events_ever_ = 0;
  std::map<double, SharedPicture> pictures_;
  std::int32_t session_ = 0;
  std::int32_t revision_ = 0;
};

}  // namespace ignis
