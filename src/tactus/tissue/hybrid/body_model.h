#pragma once
/// Lattice, materials and boundary conditions of a body.
#include <cstdint>
#include <span>
#include <vector>

#include "tactus/tissue/boundary/boundary.h"
#include "tactus/tissue/flsm/flsm.h"
#include "tactus/tissue/tled/tled.h"

namespace tactus {

/// Which cubes are elements: 1; the others are shape-matched.
using ElementMask = std::vector<std::uint8_t>;

/// Lattice, materials and boundary conditions of a body, as its owner keeps them: solvers read it while they
/// are made. Nothing of it changes afterwards, but for the additions of a cut (TopologyChange).
struct BodyModel {
  const CubeLattice& lattice;
  std::span<const std::uint8_t> elements = {};  ///< per cube, as ElementMask; empty: all are elements
  std::span<const ElasticMaterial> materials;   ///< of elements
  /// Per cube: number of its material; empty: all have the first. The entries of shape-matched cubes don't
  /// matter.
  std::span<const std::uint8_t> material_of_cube = {};
  TledOptions tled = {};
  FlsmMaterial flsm = {};
  BoundaryConditions conditions = {};
};

}  // namespace tactus
