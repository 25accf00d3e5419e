#pragma once
/// Triangles made small enough, where that is asked for.
#include <functional>
#include <optional>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Halves the longest edges of triangles (Rivara 1984) until none of those that are asked for has an edge
/// that is longer than `edge_m`. Neighbours are halved with them, so the surface stays closed where it was,
/// and triangles get larger step by step beyond. Shapes don't get worse: no angle falls below half of the
/// least.
/// @param mesh no normals are made @param is_asked for a triangle's box
/// @returns none where that takes more than `most_vertices`
std::optional<TriangleMesh> bisect_edges(TriangleMesh mesh, float edge_m,
                                         const std::function<bool(const Box3f&)>& is_asked,
                                         std::size_t most_vertices);

}  // namespace tactus
