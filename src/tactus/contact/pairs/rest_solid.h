#pragma once
/// The part of a body that others can touch: the cubes next to its surface, with signed distances at rest.
#include <array>
#include <vector>

#include "tactus/contact/cube_map.h"
#include "tactus/geom/lattice/cube_lattice.h"

namespace tactus {

struct RestSolid {
  std::vector<Index> cubes;     ///< of the lattice, ascending
  std::vector<float> sample_m;  ///< CubeSamples::kCount of each of those cubes
};

/// Cubes within kBandSpacings of the surface. Distances are exact at the samples of cubes that hold surface
/// and trilinear between their corners in the others.
/// @throws Error for a mesh that bounds no solid.
RestSolid rest_solid(const CubeLattice& lattice, const TriangleMesh& surface, MeshFill fill);
/// No point may get deeper into a body: contact would not find it.
inline constexpr float kBandSpacings = 2.5F;

}  // namespace tactus
