#pragma once
/// Vectors of which there is one per cell, as three fields: neighbours along x read and write whole lines.
#include "tactus/base/vec.h"
#include "tactus/compute/view.h"

namespace tactus {

template <class T>
TACTUS_HD Vec3f vector_at(View<T> fields, Index cells, Index cell) {
  return {fields[cell], fields[cells + cell], fields[2 * cells + cell]};
}

TACTUS_HD inline Vec3f constant_vector_at(View<const float> fields, Index cells, Index cell) {
  return {fields.constant(cell), fields.constant(cells + cell), fields.constant(2 * cells + cell)};
}

TACTUS_HD inline void store_vector(View<float> fields, Index cells, Index cell, Vec3f v) {
  fields[cell] = v.x;
  fields[cells + cell] = v.y;
  fields[2 * cells + cell] = v.z;
}

/// Nodes in cells: x + prediction_s v and v.
struct NodeFields {
  View<float> predicted_m, v_m_s;  ///< three fields each
  Index cells = 0;                 ///< 0: nodes are elsewhere
  float prediction_s = 0;
  TACTUS_HD Vec3f velocity(Index cell) const { return vector_at(v_m_s, cells, cell); }
  TACTUS_HD Vec3f position(Index cell) const {
    return vector_at(predicted_m, cells, cell) - prediction_s * velocity(cell);
  }
  TACTUS_HD void change(Index cell, Vec3f dx_m, Vec3f dv_m_s) const {
    store_vector(predicted_m, cells, cell,
                 vector_at(predicted_m, cells, cell) + (dx_m + prediction_s * dv_m_s));
    store_vector(v_m_s, cells, cell, velocity(cell) + dv_m_s);
  }
};

}  // namespace tactus
