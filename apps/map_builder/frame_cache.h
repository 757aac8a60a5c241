// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <utility>

#include "map_builder/view_board.h"

namespace ignis {

/// One binary message of the stream.
struct StreamFrame {
  bool is_snapshot = false;
  SharedBytes bytes;
};

/// Encodes what takes a viewer from the picture that it has to a newer one, once for all viewers in the same position.
class FrameCache {
 public:
  /// `base` may be empty: then, and when it is the smaller message, the frame is a snapshot.
  [[nodiscard]] StreamFrame frame(const SharedPicture& base, const SharedPicture& target);

  /// Forgets all frames: newer pictures have come.
  void clear() { frames_.clear(); }

 private:
  // The keys hold their pictures, so that no later picture can take over an address.
  std::map<std::pair<SharedPicture, SharedPicture>, StreamFrame> frames_;
};

}  // namespace ignis
