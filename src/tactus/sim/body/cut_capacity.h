#pragma once
/// Capacity for cuts in a body's shape.
#include "tactus/sim/body/body_shape.h"
#include "tactus/tissue/embedded_surface.h"

namespace tactus {

/// Copies of cubes that the body has capacity for at first; 0: it isn't cuttable.
Index first_cut_capacity(const BodyDescription& body, const BodyShape& shape);

/// The shape with places for so many copies of cubes.
BodyShape with_cut_capacity(BodyShape shape, Index copies);

/// Copies of cubes that so many straight strokes through all of a body make, in any directions. Measured with
/// 8 to 20 cubes across: at most 4.2 a stroke and cubes^(2/3), and 12.5 per cube after 50 strokes. This is
/// more, as a frame is cut only if there is capacity for the most that it may need.
Index copies_of_strokes(Index cubes, int strokes);

/// Vertices and triangles that a lattice with so many copies may need.
SurfaceCapacity surface_capacity(const CubeLattice& lattice, const TriangleMesh& surface);

/// Points that touch that cuts may add: walls have four per cube on each side, and some at their edges.
Index point_capacity(const CubeLattice& lattice);

}  // namespace tactus
