#pragma once
/// The wall along which a cube falls in two: triangles in the six tetrahedra round the cube's diagonal.
#include <array>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus::cut {

/// Plane of a wall; what lies above is on side 1.
struct WallPlane {
  Vec3d point, normal;
  double above(Vec3d p) const { return dot(normal, p - point); }
};

/// Corners of a cube have sides, and the wall crosses the ways between corners on different sides. In each
/// tetrahedron (Kuhn 1960) it is one triangle, or two. Neighbours have the same tetrahedra on the face that
/// they share, so walls fit together. Places are in lattice coordinates.
class Wall {
 public:
  Wall() = default;
  /// @param sides bit q: corner q of the cube is on side 1
  /// @param crossing place between two corners, per pair of kCornerPairs; of pairs on one side unused
  Wall(Vec3i cube, std::uint8_t sides, const std::array<Vec3d, 19>& crossing);

  /// Side of a point in the cube.
  int side(Vec3d p) const;
  /// A triangle with its normal to side 1: indices of kCornerPairs, and its tetrahedron.
  struct Triangle {
    std::array<int, 3> pair;
    int tet;
  };
  const std::vector<Triangle>& triangles() const { return triangles_; }
  /// Planes that part a tetrahedron: without a `middle` of the two others, there is one wall.
  struct Parting {
    bool is_parted = false, is_double = false;
    int side = 0;            ///< of all of it, if it is not parted
    WallPlane middle;        ///< is_double: which wall counts
    WallPlane below, above;  ///< walls, below and above the middle; the only one is `below`
  };
  const Parting& parting(int tet) const { return tets_[static_cast<std::size_t>(tet)]; }
  /// Tetrahedron that holds a point of the cube.
  int tet_of(Vec3d p) const;
  static const std::array<std::array<int, 4>, 6> kTets;  ///< corners

 private:
  void add(int tet, int a, int b, int c, const std::array<Vec3d, 19>& crossing, Vec3d on_side_1,
           WallPlane& plane);
  Vec3i cube_{};
  std::array<Parting, 6> tets_;
  std::vector<Triangle> triangles_;
};

/// A part of a cube's material.
using Tet = std::array<Vec3d, 4>;
double volume(const Tet& tet);
/// The six tetrahedra of a cube.
std::vector<Tet> whole_cube(Vec3i cube);
/// Material on both sides of a wall, in place of what `parts` held.
void part(const std::vector<Tet>& material, const Wall& wall, std::array<std::vector<Tet>, 2>& parts);

}  // namespace tactus::cut
