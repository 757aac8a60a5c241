// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "frontend/planes/plane_fit.h"
#include "frontend/planes/row_sums.h"

namespace ignis {

/// fit_plane for four neighbourhoods side by side, in single precision, as what the moments were added up in: one
/// by one, two thirds of the time is waiting for divisions and roots. Normals agree with fit_plane's within some 1e-5
/// rad where the plane stands apart from a line or a ball, and what no gate lets through only roughly.
///
/// `fits`: where the planes of the first lanes go, at most four.
void fit_four_planes(const FourMoments& moments, const FrontendConfig& config, double radius,
                     std::span<PlaneFit* const> fits);

}  // namespace ignis
