#pragma once
/// A mesh of a liquid, for export. (Pictures don't need one: view/gl_liquid.h.)
#include <span>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// The surface |x - mean| = 0.545 d, with the mean of the particles within 2 d of x, weighted by
/// (1 - (r / 2d)^2)^3 (Zhu & Bridson 2005). Half a spacing above the outermost layer, that layer's mean is
/// 0.545 d away, so a still pool has its level. Closed; without normals; empty without particles.
/// @param x_m particles on the host; one that isn't finite is nowhere @param spacing_m d, > 0
TriangleMesh liquid_mesh(std::span<const Vec3f> x_m, float spacing_m);

}  // namespace tactus
