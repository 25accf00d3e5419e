#pragma once
/// Edges of a surface that are to be seen as such.
#include "tactus/geom/mesh.h"

namespace tactus {

/// Gives vertices at creases a normal for each side: a vertex whose triangles face ways that are more than
/// about 45 degrees apart becomes several, at one place. Triangles keep their order. What had a normal and
/// lies at no crease keeps it. Needles, whose own normal is rounding, go with a neighbour.
void split_creases(TriangleMesh& mesh);

}  // namespace tactus
