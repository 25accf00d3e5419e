#pragma once
/// How much touching points of bodies, and places where they touch, weigh on nodes: sums of integers, in any
/// order.
#include "tactus/contact/pairs/pair_views.h"
#include "tactus/contact/response_kernels.h"

namespace tactus {

TACTUS_HD inline std::uint32_t signed_units(float weight, int sign) {
  const std::uint32_t units = PointWeights::quantized(weight);
  return sign > 0 ? units : 0U - units;
}
TACTUS_HD inline void add_row_weight(const PairState& state, Index row, std::uint32_t units) {
  if (units != 0U) atomic_add(state.row_weight[row], units);
}
/// Adds the weights of a point and of where it touches to their rows.
TACTUS_HD inline void add_pair_weights(const PairTable& table, const PairState& state, Index i,
                                       const PairContact& contact, int sign) {
  const EmbeddedPoint& point = table.points[i];
  const SolidCube& cube = table.cubes[contact.cube];
  for (int k = 0; k < 8; ++k) {
    if (point.weight[k] != 0.F)
      add_row_weight(state, table.rows[8 * i + k], signed_units(point.weight[k], sign));
    add_row_weight(state, cube.row[k], signed_units(CubeMap::weight(contact.q, k), sign));
  }
}

}  // namespace tactus
