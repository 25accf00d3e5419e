#pragma once
/// The surface of a ball.
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Closed, centred at 0, with the volume of the ball. @param n pieces of a quarter turn, >= 1
TriangleMesh sphere_surface(float radius_m, Index n);

}  // namespace tactus
