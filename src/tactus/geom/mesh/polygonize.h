#pragma once
/// A closed mesh around the space where a distance function is negative.
#include <functional>
#include <limits>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Marching cubes with shared vertices on a grid of `cells` along the box's longest side; vertices are where
/// the function is 0 between two nodes, linearly. Nodes on the box's boundary count as outside, so the mesh
/// is closed. @param distance_m negative inside; called from several threads
/// @param steepest the function changes by no more than that along a metre: 1 of a distance. Far outside it
/// is not asked at every node then.
/// @throws Error for an empty box, or cells outside 1 to 1000.
TriangleMesh polygonize(const Box3f& box_m, Index cells, const std::function<float(Vec3f)>& distance_m,
                        float steepest = std::numeric_limits<float>::infinity());

}  // namespace tactus
