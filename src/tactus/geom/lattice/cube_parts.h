#pragma once
/// How much of each cube of a grid a closed surface encloses, on the host.
#include <cstdint>
#include <vector>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// A grid of cubes: cube (i, j, k) has its lowest corner at origin_m + spacing_m (i, j, k).
struct CubeCells {
  Vec3f origin_m{};
  float spacing_m = 0;
  Vec3i dims{};
  std::int64_t index(Vec3i c) const { return (std::int64_t{c.z} * dims.y + c.y) * dims.x + c.x; }
  std::int64_t count() const { return std::int64_t{dims.x} * dims.y * dims.z; }
  bool holds(Vec3i c) const {
    return c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x < dims.x && c.y < dims.y && c.z < dims.z;
  }
};

/// The solid part of a cube that the surface passes through.
struct CubePart {
  Vec3i cube{};
  double volume = 0;  ///< share of the cube, more than 0 and at most 1
  Vec3d centroid{};   ///< 0..1 along each edge
  Vec3d second{};     ///< mean of (x - 1/2)^2 along each edge
};

struct CubeParts {
  std::vector<std::uint8_t> full;  ///< per cube of the grid: 1 if all of it is solid
  std::vector<CubePart> partial;   ///< in ascending (z, y, x) order
};

/// Volumes and centroids by the divergence theorem: a piece of surface in a cube encloses the space behind
/// it along x,
///   V = integral over the surface of clamp(X - x_cube, 0, 1) n_x dA,
/// in the rows of the cube along x. Triangles are clipped at the faces of cubes. Integrands of second degree
/// are integrated exactly by the mean over the midpoints of a triangle's edges, those of third degree (second
/// moments) by corners, midpoints and centre. So the volumes of all cubes add up to that of the mesh but for
/// rounding of doubles. Work follows the surface, apart from
/// one visit of each cube; layers run on all cores. Where the surface overlaps itself, no cube counts twice.
/// @param closed checked by the caller (check_closed); within the grid but for rounding
CubeParts parts_of_cubes(const TriangleMesh& closed, const CubeCells& cells);

/// Moments of partly filled cubes become weights of whole ones that every model can use: share of mass and of
/// stiffness per cube, of which some are more than 1. The sum over cubes is that of the volumes.
struct CubeFills {
  /// How the mass of a cube lies, in masses of a full cube. Entries of one cube add up.
  struct Moments {
    std::int64_t cell = 0;
    Vec3d first{};   ///< about its centre, in spacings
    Vec3d excess{};  ///< see CubeLattice::OffCentre, in spacings^2
  };
  std::vector<std::uint8_t> exists;  ///< per cube of the grid
  std::vector<float> fill;           ///< likewise
  std::vector<Moments> moments;      ///< in ascending order of cells
};
/// An element has the strain of its centre. The part at the surface lies off it, towards the inside: with its
/// volume as the weight, a box of 4.1 cubes across would bend 18 % too stiffly. So kTowardsCentroid of the
/// way from centre to centroid, the part is handed to the neighbours on that side, trilinearly. All of the
/// way would keep first moments exactly, but turned bars would bend 3 to 6 % too softly: forces on nodes at
/// the surface aren't in equilibrium there. This much leaves 0 to 3 % (four cubes across, turned by 15, 30,
/// 45 degrees and about a diagonal), and straight bars of 4.1 to 4.7 cubes 6 to 10 % too stiff.
///
/// A sliver whose centroid is within kSliverReach spacings of a fuller neighbour joins it, and is no cube.
/// Others below kLeastFill are filled up from a neighbour where one has enough: contact pulls nodes far that
/// carry nothing.
///
/// What a part hands on lies at the centres of its neighbours. The rest lies where the first moment of both
/// is that of the part (`moments`).
CubeFills fills_of_parts(const CubeParts& parts, const CubeCells& cells);
inline constexpr double kTowardsCentroid = 0.65, kSliverReach = 0.02, kLeastFill = 1.0 / 32;

}  // namespace tactus
