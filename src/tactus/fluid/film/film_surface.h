#pragma once
/// The surface that a film lies on.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"
#include "tactus/geom/arrays/index_lists.h"

namespace tactus {

/// A surface that a film lies on. It may move, and cuts may change it.
struct FilmSurface {
  Count vertices = 0, triangles = 0;
  View<const Vec3f> x_m;
  View<const Index> corners;     ///< three vertices each
  View<const IndexRange> lists;  ///< per vertex, of entries of `incident`
  View<const Index> incident;    ///< triangles
};

}  // namespace tactus
