#pragma once
/// Why a triangle mesh does not bound a solid, on the host.
#include <cstdint>
#include <string>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Places of one kind: how many, and the first.
struct EdgeDefect {
  std::int64_t count = 0;
  Vec3f from_m{}, to_m{};
};
struct EdgeDefects {
  EdgeDefect open;      ///< used by one triangle
  EdgeDefect opposed;   ///< two triangles that face opposite ways
  EdgeDefect unpaired;  ///< more than two triangles that don't pair up
  EdgeDefect crowded;   ///< more than two triangles that do: closed, but no manifold
  bool bounds_solid() const { return open.count + opposed.count + unpaired.count == 0; }
  /// "3 open edges, the first from (0, 0, 0) to (1, 0, 0) m; 1 edge ...": all but `crowded`.
  std::string text() const;
};
/// Indices must be in range. Edges without extent in the index (a == b) don't count.
EdgeDefects find_edge_defects(const TriangleMesh& mesh);
/// "2 edges of more than two triangles, the first from (..) to (..) m"
std::string defect_text(const EdgeDefect& defect, const std::string& one, const std::string& many);

/// Pairs of triangles without a common vertex that cut one another: where a surface overlaps itself.
struct SelfCrossings {
  std::int64_t pairs = 0;
  Vec3f first_m{};  ///< a point of the first crossing
};
SelfCrossings find_self_crossings(const TriangleMesh& mesh);

/// @throws Error naming the mesh when it has no triangles, indices out of range or NaN.
void check_finite(const TriangleMesh& mesh, const char* what);
/// The same, and when it does not bound a solid: how many edges, where.
void check_closed(const TriangleMesh& mesh, const char* what);

}  // namespace tactus
