// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "common/byte_codec.h"
#include "common/time.h"

namespace ignis {

/// Tells one broken stamp of the far future from a stream that really goes on there, after a gap: the stamp is put
/// aside until a second one carries on from it.
class LeapGuard {
 public:
  /// True when `utime` lies more than a second ahead of `newest` and nothing has confirmed that yet.
  bool leaps_ahead(Utime newest, Utime utime) {
    if (utime - newest <= kMicrosPerSecond) {
      put_aside_.reset();
      return false;
    }
    const bool carries_on = put_aside_ && utime > *put_aside_ && utime - *put_aside_ <= kMicrosPerSecond;
    put_aside_ = utime;
    return !carries_on;
  }

 private:
  std::optional<Utime> put_aside_;

  friend void transfer(auto& io, FieldsOf<LeapGuard> auto& guard) { io.maybe(guard.put_aside_); }
};

}  // namespace ignis
