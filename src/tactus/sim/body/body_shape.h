#pragma once
/// From a scene's description of a body to its surface, its cubes and their materials.
#include <map>
#include <string>
#include <vector>

#include "tactus/geom/lattice/label_volume.h"
#include "tactus/sim/scene.h"
#include "tactus/tissue/boundary/driven_nodes.h"
#include "tactus/tissue/boundary/surface_loads.h"
#include "tactus/tissue/hybrid/hybrid.h"

namespace tactus {

/// A body's shape, placed in the world, and the materials of its cubes.
struct BodyShape {
  TriangleMesh surface_m;    ///< closed, world
  bool has_creases = false;  ///< that are meant: of boxes and files; samples of a smooth shape have none
  CubeLattice lattice;       ///< with masses and the fixed nodes of the description
  ElementMask elements;
  std::vector<ElasticMaterial> materials;
  std::vector<std::uint8_t> material_of_cube;
  std::vector<float> bleeding_of_cube;  ///< factor of the body's rate, per regular cube; empty: 1
  std::vector<NodeMotion> motions;
  std::vector<SurfaceLoad> loads;
  std::vector<std::string> warnings;  ///< oddities that are probably not meant
};
/// @param memory_bytes of the device: spacings whose fields would not fit are refused
/// @throws Error naming the body for a shape that cannot become a lattice (mesh that bounds no solid, spacing
/// larger than the body, ...) and for regions that would do nothing.
BodyShape make_body_shape(const BodyDescription& body, const BodyAssets& assets, double memory_bytes = 8e9);

}  // namespace tactus
