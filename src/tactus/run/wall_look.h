#pragma once
/// Walls of cuts as they are drawn: flesh, with a rounded lip.
#include <vector>

#include "tactus/geom/mesh/refine_edges.h"
#include "tactus/view/scene.h"
#include "tactus/world/step_report.h"

namespace tactus {

/// Gives walls vertices of their own where skin still shares them, after split_creases(), and normals: those
/// of walls change over a spacing, however thin their triangles are.
/// @param origins of split_creases(); gets those of the new vertices
ViewFlesh part_walls(TriangleMesh& surface, const CutWalls& walls, std::vector<Index>& origins);
void follow_refinement(ViewFlesh& flesh, const EdgeRefinement& made);

}  // namespace tactus
