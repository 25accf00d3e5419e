#pragma once
/// A point of a body that moves with its lattice.
#include <array>
#include <span>
#include <string>

#include "tactus/sim/body/body_shape.h"
#include "tactus/tissue/body_monitors.h"
#include "tactus/tissue/embedding.h"

namespace tactus {

/// Where a point of a body at rest sits: in a cube of the lattice, by its eight nodes.
struct BodyPoint {
  std::array<Index, 8> nodes{};  ///< corner q at (q & 1, q >> 1 & 1, q >> 2)
  Vec3f local{};                 ///< in [0, 1] inside the cube
  Index cube = 0;                ///< of the lattice

  /// Trilinear in the cube's nodes [P 15].
  Vec3f position_m(std::span<const Vec3f> node_x_m) const;
};

/// Means over cubes, which are strained at their centres, for a point: from cubes to their nodes, by their
/// fill, and from nodes to the point as its position. Stress is of elements alone.
struct StrainAtPoint {
  std::vector<Index> cubes;
  std::vector<double> strain_weight, stress_weight;  ///< each of sum 1; stress 0 where there is no element

  /// @param of_cubes strains of `cubes`, in their order
  CubeStrain mean(std::span<const CubeStrain> of_cubes) const;
};
StrainAtPoint strain_at_point(const BodyShape& shape, const BodyPoint& point);

/// How far a point lies outside of a body.
struct OutsideBody {
  float distance_m;  ///< to the body's surface
  Vec3f nearest_m;   ///< the point on it, world
};

/// "[0.1, -0.2, 0]", to the micrometre: for messages.
std::string point_text(Vec3d p_m);

/// The point at rest at `rest_m` (world), or why there is none. Points up to a tenth of a cube outside the
/// surface count as on it: seen surfaces are polygons. Host.
struct PointInBody {
  BodyPoint point;
  std::optional<OutsideBody> outside;
};
PointInBody place_point(const BodyShape& shape, MeshFill fill, Vec3f rest_m);

}  // namespace tactus
