#pragma once
/// Photographs as the texture of a mesh, for files: each triangle is cut from one photo.
#include <span>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/mesh/textured_mesh.h"

namespace tactus {

/// The atlas holds of every photo the rectangle that is used, a few pixels more against bleeding, and a white
/// patch for triangles without a photo: those take the colours of their vertices.
/// @param mesh with normals  @param triangle_cameras per triangle a camera or -1 (SurfaceTexture::choose)
/// @param colors one a vertex
/// @throws Error when the numbers don't fit, or the atlas would be more than 16384 px high.
TexturedMesh make_photo_atlas(const TriangleMesh& mesh, std::span<const Index> triangle_cameras,
                              std::span<const Rgb8> colors, std::span<const Camera> cameras,
                              std::span<const ColorImage> photos);

}  // namespace tactus
