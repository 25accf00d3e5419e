#pragma once
/// A mesh that wears a picture.
#include "tactus/geom/image/image.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Vertices along seams are repeated: one position, several places in the atlas.
struct TexturedMesh {
  TriangleMesh mesh;
  std::vector<Vec2f> uv;       ///< one a vertex, 0 to 1 from the atlas' top left corner
  std::vector<Rgb8> colors;    ///< one a vertex, sRGB: multiplies the atlas; white where a photo shows
  std::vector<Index> photo{};  ///< one a vertex: the photo that it is cut from; -1: none, its place is white
  ColorImage atlas{};
};

}  // namespace tactus
