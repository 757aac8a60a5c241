// SPDX-License-Identifier: Apache-2.0
#include "map/cell_index.h"

namespace ignis {
namespace {

std::int32_t floor_divide(std::int32_t value, std::int32_t divisor) {
  const std::int32_t quotient = value / divisor;
  return value % divisor < 0 ? quotient - 1 : quotient;
}

}  // namespace

CellIndex parent_cell(const CellIndex& cell, int ratio) {
  return {floor_divide(cell.x, ratio), floor_divide(cell.y, ratio), floor_divide(cell.z, ratio)};
}

}  // namespace ignis
