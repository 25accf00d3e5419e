#pragma once
/// Capacity for cuts in a body's shape.
#include "tactus/sim/body/body_shape.h"
#include "tactus/tissue/embedded_surface.h"

namespace tactus {

/// The shape with places for copies of cubes, if the body is cuttable.
BodyShape with_cut_capacity(const BodyDescription& body, BodyShape shape);

/// Vertices and triangles that a lattice with so many copies may need.
SurfaceCapacity surface_capacity(const CubeLattice& lattice, const TriangleMesh& surface);

/// Points that touch that cuts may add: walls have four per cube on each side, and some at their edges.
Index point_capacity(const CubeLattice& lattice);

}  // namespace tactus
