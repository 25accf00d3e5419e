#pragma once
/// Silhouettes of meshes through pinhole cameras, on the host: reconstructions are measured against them.
#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Pixels whose centres the mesh covers, seen by `camera`; the centre of the top-left pixel is (0,0). Both
/// sides of a triangle cover; parts behind the camera are clipped away.
///
/// Projected vertices are rounded to 2^-14 px and the edge tests are exact integers that include the edge, so
/// a closed mesh has no pinhole between neighbouring triangles, and the mask is the same for every number of
/// threads. Triangles thinner than the rounding (zero area) cover nothing.
/// @throws Error for a bad camera (see check_camera), an image side over 16384 px, a vertex index outside the
/// mesh, or a vertex in use that is not finite.
BitMask render_silhouette(const TriangleMesh& mesh, const Camera& camera);

}  // namespace tactus
