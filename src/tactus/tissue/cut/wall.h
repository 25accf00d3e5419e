#pragma once
/// The wall along which a cube falls in two: triangles in the six tetrahedra round the cube's diagonal.
#include <array>
#include <cstdint>
#include <span>

#include "tactus/base/vec.h"

namespace tactus::cut {

/// Plane of a wall; points above it are on side 1.
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
  /// @param own corners with material: a tetrahedron whose own corners are on one side is there as a whole
  /// @param wedges per side: pairs with material there, though their corners on it are not own
  /// @param crossing place between two corners, per pair of kCornerPairs; of pairs on one side unused
  Wall(Vec3i cube, std::uint8_t sides, std::uint8_t own, const std::array<Vec3d, 19>& crossing,
       const std::array<std::uint32_t, 2>& wedges = {});

  /// Without triangles: parts what has nothing between its pieces.
  /// @param side per tetrahedron: of all of it; -1: the plane says
  Wall(Vec3i cube, const WallPlane& plane, const std::array<int, 6>& side);

  /// Side of a point in the cube.
  int side(Vec3d p) const;
  /// A triangle with its normal to side 1: indices of kCornerPairs, and its tetrahedron.
  struct Triangle {
    std::array<std::uint8_t, 3> pair;
    std::uint8_t tet;
  };
  std::span<const Triangle> triangles() const { return std::span(triangles_).first(triangle_count_); }
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
  std::array<Triangle, 12> triangles_{};
  std::uint8_t triangle_count_ = 0;
};

/// A part of a cube's material.
using Tet = std::array<Vec3d, 4>;
double volume(const Tet& tet);
/// The six tetrahedra of a cube.
std::array<Tet, 6> whole_cube(Vec3i cube);
/// Part of a tetrahedron on one side of a plane, below or above it.
struct TetPart {
  std::array<Tet, 3> tets;
  std::size_t count;
  void push_back(const Tet& tet) { tets[count++] = tet; }
};
using TetParts = std::array<TetPart, 2>;
TetParts clip(const Tet& tet, const WallPlane& plane);

/// Calls f(side, tet, volume) for the parts of a tetrahedron on the wall's sides. It must lie in one
/// tetrahedron of the wall.
template <class F>
void part(const Tet& tet, const Wall& wall, F&& f) {
  const auto add = [&](int side, const Tet& part) {
    constexpr double kLeast = 1e-12;
    if (const double v = volume(part); !(v < kLeast)) f(side, part, v);
  };
  const auto for_each = [](const TetPart& of, const auto& each) {
    for (std::size_t k = 0; k < of.count; ++k) each(of.tets[k]);
  };
  const auto add_parts = [&](const Tet& of, const WallPlane& plane) {
    const TetParts parts = clip(of, plane);
    for (const int side : {0, 1})
      for_each(parts[side == 0 ? 0 : 1], [&](const Tet& part) { add(side, part); });
  };
  const Wall::Parting& parting = wall.parting(wall.tet_of(0.25 * (tet[0] + tet[1] + tet[2] + tet[3])));
  if (!parting.is_parted) {
    add(parting.side, tet);
    return;
  }
  if (!parting.is_double) {
    add_parts(tet, parting.below);
    return;
  }
  const TetParts parts = clip(tet, parting.middle);
  for_each(parts[0], [&](const Tet& below) { add_parts(below, parting.below); });
  for_each(parts[1], [&](const Tet& above) { add_parts(above, parting.above); });
}

}  // namespace tactus::cut
