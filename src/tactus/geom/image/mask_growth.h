#pragma once
/// Silhouettes that admit their own uncertainty.
#include "tactus/geom/image/image.h"

namespace tactus {

/// Sets every pixel within `steps` horizontal or vertical steps of a set one. Reuses the memory of `out`.
void grow_mask(const BitMask& mask, int steps, BitMask& out);

}  // namespace tactus
