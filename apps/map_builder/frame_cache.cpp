// SPDX-License-Identifier: Apache-2.0
#include "map_builder/frame_cache.h"

#include "map/stream_encoding.h"

namespace ignis {
namespace {

StreamFrame encode(const MapPicture* base, const MapPicture& target) {
  if (base != nullptr) {
    std::optional<std::string> delta = encode_delta(*base, target);
    if (delta && delta->size() < snapshot_bytes(target)) return {false, shared(std::move(*delta))};
  }
  return {true, shared(encode_snapshot(target))};
}

}  // namespace

StreamFrame FrameCache::frame(const SharedPicture& base, const SharedPicture& target) {
  StreamFrame& frame = frames_[{base, target}];
  if (!frame.bytes) frame = encode(base.get(), *target);
  return frame;
}

}  // namespace ignis
