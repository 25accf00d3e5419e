#pragma once
/// The separate components of a surface: how large, where, and how they lie. On the host.
#include <vector>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// One connected component of a mesh. Moments are those of the enclosed volume (divergence theorem).
struct MeshComponent {
  Index vertices = 0, triangles = 0;
  double volume_m3 = 0;  ///< negative: the wall of a cavity
  double area_m2 = 0;
  Vec3d centroid_m;  ///< centre of the volume; of the area where there is none
  Mat3d axes =
      Mat3d::identity();  ///< rows: unit principal axes, the longest first, right-handed; of any sign
  Vec3d extent_m;         ///< standard deviation of the volume along each axis
};

struct MeshComponents {
  std::vector<MeshComponent> components;  ///< largest volume first
  std::vector<Index> of_vertex;           ///< index into components; -1: the vertex is in no triangle
};

/// Components that share no vertex. @throws Error when a triangle has a vertex that is not there.
MeshComponents find_components(const TriangleMesh& mesh);

/// The axes (rows) with the signs nearest to those of before; right-handed.
Mat3d with_signs_of(const Mat3d& before, Mat3d axes);

}  // namespace tactus
