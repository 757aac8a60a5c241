// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "study_drive.h"

namespace ignis::bench {

/// How wrong loops relate to one another.
enum class Lies {
  kIndependent,  ///< each between two keyframes drawn at random, wrong by 0.3 to 6 m and a tenth of that in rad
  kGroups,  ///< up to 20 that agree: a stretch of the way is taken for one 2.5 to 6 m beside it, as in parallel aisles
};

struct StudyLoop {
  LoopMeasurement measurement;
  bool is_true = true;
};

/// The true loops of the drive with wrong ones among them, so many that these are `share` of all (one at least, unless
/// the share is 0; of groups, as many as the drive has room for). Ascending from_id, wrong ones first. Each has the
/// information of a true loop drawn at random.
[[nodiscard]] std::vector<StudyLoop> with_lies(const StudyDrive& drive, double share, Lies lies, unsigned seed);

}  // namespace ignis::bench
