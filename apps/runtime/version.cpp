// SPDX-License-Identifier: Apache-2.0
#include "runtime/version.h"

#include "build_id.h"

namespace ignis::runtime {

std::string version() { return IGNIS_VERSION; }

std::string build() { return IGNIS_BUILD; }

}  // namespace ignis::runtime
