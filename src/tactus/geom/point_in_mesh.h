#pragma once
/// Inside and distance queries on a closed triangle mesh, on the host.
#include <cstdint>
#include <vector>

#include "tactus/geom/mesh.h"

namespace tactus {

/// Winding numbers and distances of points. Keeps its own copy of the triangles.
class PointInMesh {
 public:
  /// @throws Error on no triangles, NaN, indices out of range and open meshes (how many open edges, where).
  explicit PointInMesh(const TriangleMesh& mesh);

  /// How often the surface goes round p: signed crossings of the ray along +x. Edges and vertices that the
  /// ray meets are decided by one symbolic perturbation (Edelsbrunner & Muecke 1990), so a closed mesh never
  /// leaks.
  int winding(Vec3f p_m) const;
  bool inside(Vec3f p_m) const { return winding(p_m) != 0; }
  /// Distance to the nearest triangle [m].
  float distance_m(Vec3f p_m) const;
  /// Negative inside.
  float signed_distance_m(Vec3f p_m) const { return inside(p_m) ? -distance_m(p_m) : distance_m(p_m); }

 private:
  struct Node {  ///< of a tree of boxes; leaf: count > 0
    Box3f box;
    Index first = 0, count = 0, right = 0;
  };
  Index build_tree(std::vector<Index>& order, Index first, Index count);
  void build_columns();

  std::vector<Vec3f> positions_;
  std::vector<std::array<Index, 3>> triangles_;
  std::vector<Node> tree_;
  std::vector<Index> order_;  ///< triangles of the tree's leaves
  Box3f bounds_{};
  Index columns_ = 1;  ///< the (y, z) plane is cut into columns_^2 columns
  std::vector<Index> column_begin_, column_triangles_;
};

/// @throws Error when the mesh has no triangles, indices out of range, NaN or open edges; `what` names it.
void check_closed(const TriangleMesh& mesh, const char* what);

/// Squared distance from p to triangle abc (Ericson 2005, 5.1.5).
float squared_distance_to_triangle(Vec3f p, Vec3f a, Vec3f b, Vec3f c);

}  // namespace tactus
