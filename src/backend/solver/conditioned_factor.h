// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/shared_ptr.hpp>

namespace gtsam {
class NonlinearFactor;
class Values;
}  // namespace gtsam

namespace ignis {

/// What `factor` says of its other variables where those in `known` have the values that stand there. The factor itself
/// when `known` holds none of its variables, and nothing when it holds all of them. Linearising it must give rows of a
/// least-squares problem, as that of every factor with a noise model does.
[[nodiscard]] boost::shared_ptr<gtsam::NonlinearFactor> conditioned(
    const boost::shared_ptr<gtsam::NonlinearFactor>& factor, const gtsam::Values& known);

}  // namespace ignis
