#pragma once
/// Inside and distance queries on a closed triangle mesh, on the host.
#include <cstdint>
#include <vector>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Winding numbers and distances of points. Keeps its own copy of the triangles.
class PointInMesh {
 public:
  /// @throws Error on no triangles, NaN, indices out of range and, for MeshFill::closed, meshes that don't
  /// bound a solid (how many edges, where).
  explicit PointInMesh(const TriangleMesh& mesh, MeshFill fill = MeshFill::closed);

  /// How often the surface goes round p: signed crossings of the ray along +x. Edges and vertices that the
  /// ray meets are decided by one symbolic perturbation (Edelsbrunner & Muecke 1990), so a closed mesh never
  /// leaks.
  int winding(Vec3f p_m) const;
  /// The solid angle that the surface fills as seen from p, over 4 pi; far triangles by their dipoles (Barill
  /// et al. 2018). Only with MeshFill::winding.
  double generalized_winding(Vec3f p_m) const;
  bool inside(Vec3f p_m) const;
  /// Distance to the nearest triangle [m].
  float distance_m(Vec3f p_m) const;
  /// Negative inside.
  float signed_distance_m(Vec3f p_m) const { return inside(p_m) ? -distance_m(p_m) : distance_m(p_m); }

 private:
  struct Node {  ///< of a tree of boxes; leaf: count > 0
    Box3f box;
    Index first = 0, count = 0, right = 0;
  };
  struct Dipole {  ///< the triangles of a node as seen from afar
    Vec3d area_m2, center_m;
    double size_m2, radius_m;
  };
  Index build_tree(std::vector<Index>& order, Index first, Index count);
  void build_columns();
  void build_dipoles();

  MeshFill fill_;
  std::vector<Vec3f> positions_;
  std::vector<std::array<Index, 3>> triangles_;
  std::vector<Node> tree_;
  std::vector<Dipole> dipoles_;  ///< per node of the tree
  std::vector<Index> order_;     ///< triangles of the tree's leaves
  Box3f bounds_{};
  Index columns_ = 1;  ///< the (y, z) plane is cut into columns_^2 columns
  std::vector<Index> column_begin_, column_triangles_;
};

/// Squared distance from p to triangle abc.
float squared_distance_to_triangle(Vec3f p, Vec3f a, Vec3f b, Vec3f c);

}  // namespace tactus
