// SPDX-License-Identifier: Apache-2.0
#include "keyframe_file.h"

#include "messages/keyframe_messages.h"
#include "messages/lcm_log.h"
#include "messages/length_check.h"
#include "runtime/application.h"
#include "runtime/channels.h"

namespace ignis::bench {

std::vector<Keyframe> read_keyframes(const std::filesystem::path& file) {
  messages::LcmLog log(file);
  messages::KeyframeAssembler assembler;
  std::vector<Keyframe> keyframes;
  while (const auto event = log.next()) {
    keyframe_t part;
    if (event->channel != runtime::channels::kKeyframe || !messages::decode_checked(event->data, part)) continue;
    if (auto keyframe = assembler.add(part)) keyframes.push_back(std::move(*keyframe));
  }
  if (keyframes.empty()) throw runtime::UserError(file.string() + " holds no keyframe");
  return keyframes;
}

}  // namespace ignis::bench
