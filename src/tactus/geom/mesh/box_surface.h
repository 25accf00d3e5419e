#pragma once
/// A box in many triangles.
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Closed, with sharp edges, centred at 0. @param half_m half its edges, > 0 @param n pieces of each edge,
/// >= 1: every square of the faces is two triangles
TriangleMesh box_surface(Vec3f half_m, Vec3i n);

}  // namespace tactus
