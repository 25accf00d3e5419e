#pragma once
/// A film of liquid on a body as it is drawn.
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "tactus/geom/mesh/refine_edges.h"
#include "tactus/view/scene.h"

namespace tactus {

/// Film and stain at each vertex of a surface become heights that change smoothly over it, and a smooth edge:
/// where the share of wet surface around falls to a value. Triangles become finer along that edge. Volume
/// isn't exact here: this is for the eye alone.
/// @param surface with normals; gets more vertices and triangles @param is_crease as refine_edges() has it
/// @param refined is told of each refinement
void lay_film(TriangleMesh& surface, std::vector<std::uint8_t>& is_crease, ViewFilm& film,
              const std::function<void(const EdgeRefinement&)>& refined);

/// Wets a surface under a pool, for the eye: where particles touch that are no film. So no dry surface is
/// seen through the pool, and its rim is a film's.
/// @param surface with normals @param film_m at each vertex, made thicker @returns whether any vertex is wet
bool wet_under(const TriangleMesh& surface, std::span<const Vec3f> particles_m, float spacing_m,
               std::vector<float>& film_m);

}  // namespace tactus
