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

}  // namespace tactus
