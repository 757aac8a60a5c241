// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace ignis::runtime {

/// The release that this is or becomes, X.Y.Z: what results name, so that those of equal programs are equal.
[[nodiscard]] std::string version();

/// Release and fingerprint of the sources, X.Y.Z+HASH: what processes tell each other, so that two builds of one
/// release that are not the same notice it.
[[nodiscard]] std::string build();

}  // namespace ignis::runtime
