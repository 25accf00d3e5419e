#pragma once
/// Triangle meshes on the host, and their topology, volume, area and bounds. Functions of triangles throw an
/// Error that names one with a corner that isn't there.
#include <array>
#include <cstdint>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus {

/// Indexed triangles, counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Vec3f> positions_m;
  std::vector<Vec3f> normals;  ///< unit, one per vertex, or none
  std::vector<std::array<Index, 3>> triangles;
};

/// How the triangles of a mesh hang together. Zero-area triangles count like others: this is topology.
struct MeshTopology {
  std::int64_t edges = 0;
  std::int64_t boundary_edges = 0;     ///< used by one triangle
  std::int64_t nonmanifold_edges = 0;  ///< used by more than two, or twice in the same direction
  std::int64_t euler = 0;              ///< vertices in use - edges + triangles
  std::int64_t components = 0;
  bool closed_manifold() const { return boundary_edges == 0 && nonmanifold_edges == 0; }
};
MeshTopology topology(const TriangleMesh& mesh);

/// Enclosed volume [m^3] by the divergence theorem; meaningful for closed meshes.
double volume_m3(const TriangleMesh& mesh);
double area_m2(const TriangleMesh& mesh);
Box3f bounds(const TriangleMesh& mesh);
/// Area-weighted vertex normals.
void compute_normals(TriangleMesh& mesh);

/// Which points are inside of a mesh.
enum class MeshFill : std::uint8_t {
  closed,  ///< winding number not 0; the mesh must be closed and consistently oriented
  winding  ///< generalized winding number at least 1/2 (Jacobson et al. 2013): holes are spanned
};

}  // namespace tactus
