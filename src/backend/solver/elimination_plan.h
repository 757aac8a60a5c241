// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace ignis {

/// Variables that are eliminated together.
struct PlannedClique {
  std::vector<int> variables;     ///< first those that go, then those that they leave connected
  std::size_t frontals = 0;       ///< variables that go
  std::vector<std::size_t> rows;  ///< whose first variable to go is among them
  std::ptrdiff_t parent = -1;     ///< clique in which the first of the others goes; -1: there is none
};

/// In which order to eliminate. `rows`: the variables that each factor ties together, as numbers below the size of
/// `dimensions`, the scalars of each variable. Those marked in `last` go last. Children stand before their parents.
///
/// The order is CCOLAMD's (T. A. Davis et al., "A column approximate minimum degree ordering algorithm", ACM TOMS
/// 30(3), 2004). Cliques are joined where the zeros that this brings cost less than a clique does.
[[nodiscard]] std::vector<PlannedClique> plan_elimination(std::span<const std::vector<int>> rows,
                                                          std::span<const int> dimensions,
                                                          const std::vector<bool>& last);

}  // namespace ignis
