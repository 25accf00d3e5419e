#pragma once
/// Edges of a surface that are to be seen as such.
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Gives vertices at creases a normal for each side: a vertex whose triangles face ways that are more than
/// about 45 degrees apart becomes several, at one place. Triangles keep their order. Vertices at no crease
/// keep the normals they had. Needles, whose own normal is rounding, go with a neighbour.
/// @param first vertices before it stay whole: of a smooth surface, however coarse it is
/// @returns of each vertex that was added, in their order: the one at whose place it is
std::vector<Index> split_creases(TriangleMesh& mesh, Index first = 0);

/// Averages the normals of neighbouring vertices so often. Those that differ by more than about 35 degrees
/// don't meet, so edges stay. The marks that a carrying lattice leaves in the surface's shading go.
void smooth_normals(TriangleMesh& mesh, int passes);

}  // namespace tactus
