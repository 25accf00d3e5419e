#include "tactus/sim/body/cut_capacity.h"

#include <algorithm>
#include <cmath>

#include "tactus/geom/lattice/lattice_cut.h"

namespace tactus {

Index first_cut_capacity(const BodyDescription& body, const BodyShape& shape) {
  if (!body.cuttable) return 0;
  return body.cut_capacity.value_or(std::max(2000, shape.lattice.cube_count() / 4));
}

BodyShape with_cut_capacity(BodyShape shape, Index copies) {
  if (copies == 0) return shape;
  shape.lattice =
      cut_lattice(shape.lattice, [](Vec3i, int) { return false; }, {.copies = copies, .nodes = 2 * copies});
  // Capacity is made of elements: only those are cut.
  shape.elements.resize(shape.lattice.cubes.size(), 1);
  shape.material_of_cube.resize(shape.lattice.cubes.size(), 0);
  return shape;
}

Index copies_of_strokes(Index cubes, int strokes) {
  const double n = cubes, of_all = 4.5 * strokes * std::cbrt(n) * std::cbrt(n);
  return static_cast<Index>(std::ceil(std::min(of_all, 16 * n)));
}

Index point_capacity(const CubeLattice& lattice) { return 6 * static_cast<Index>(lattice.copies.size()); }

/// Walls of interior copies have a dozen triangles, those at the surface some more.
SurfaceCapacity surface_capacity(const CubeLattice& lattice, const TriangleMesh& surface) {
  const auto copies = static_cast<Index>(lattice.copies.size());
  return {static_cast<Index>(surface.positions_m.size()) + 40 * copies,
          static_cast<Index>(surface.triangles.size()) + 80 * copies};
}

}  // namespace tactus
