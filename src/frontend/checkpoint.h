// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/keyframe.h"
#include "frontend/lio.h"

/// The front end's state as bytes, from which a killed process is succeeded within the drive.
///
/// A checkpoint is two records (common/byte_record.h): a head that says what it belongs to, and the whole state, local
/// map included. To a front end that was read back, the death of its predecessor is a gap in the data of both streams,
/// which the filter bridges and grows its covariance over like any other. Files stand in apps/lio_frontend.
namespace ignis {

inline constexpr std::uint32_t kCheckpointVersion = 19;

/// Requires lio.can_be_resumed().
[[nodiscard]] std::vector<std::byte> encode_checkpoint(const Lio& lio, const std::string& config_hash);

/// Of a session that has ended, with nothing to go on from: a successor begins the next one.
[[nodiscard]] std::vector<std::byte> encode_ended_session(std::int32_t session, const std::string& config_hash);

/// A front end that goes on from a checkpoint or, when there is none or it is damaged, of another version or
/// configuration, a new one that says why in start_note(). A new session has a number that the checkpoint's did not,
/// as long as the head can be read. Any bytes at all; empty: there is no checkpoint.
[[nodiscard]] Lio start_from_checkpoint(const FrontendConfig& config, const std::string& config_hash,
                                        std::span<const std::byte> bytes);

/// One record.
[[nodiscard]] std::vector<std::byte> encode_keyframe(const Keyframe& keyframe);

/// Any bytes at all; nothing when they are no whole keyframe.
[[nodiscard]] std::optional<Keyframe> decode_keyframe(std::span<const std::byte> bytes);

}  // namespace ignis
