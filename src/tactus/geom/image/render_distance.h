#pragma once
/// Distances of a mesh through a pinhole camera, on the host.
#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Distance along the ray through each pixel's centre to the nearest triangle [m], 0 where none is. Triangles
/// that reach behind the camera are left out.
/// @throws Error for a bad camera or a vertex index outside the mesh.
DepthImage render_distance(const TriangleMesh& mesh, const Camera& camera);

}  // namespace tactus
