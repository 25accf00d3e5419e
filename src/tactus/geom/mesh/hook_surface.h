#pragma once
/// The surface of a hook.
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// A round rod with round ends, closed. Its middle comes down a shaft at x = bend_m from y = 3.5 bend_m, goes
/// half around the origin below it, in the plane z = 0, and up again to a tip at (-bend_m, 0.4 bend_m).
/// @param rod_m radius of the rod, < bend_m
TriangleMesh hook_surface(float bend_m, float rod_m);

}  // namespace tactus
