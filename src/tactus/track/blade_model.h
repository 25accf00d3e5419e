#pragma once
/// A tool whose shape and cutting edge are known.
#include <string>
#include <vector>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

struct BladeModel {
  std::string name;
  TriangleMesh mesh;          ///< closed; parts may overlap. Frame of the model [m]
  std::vector<Vec3f> edge_m;  ///< polyline along the cutting edge, from the tip, in the same frame
  TriangleMesh drawn{};       ///< for pictures, where something finer than `mesh` is known
};

/// @throws Error naming the model and its fault: no edge, an edge that is not at its surface, an open mesh, a
/// size that says another unit than the metre.
void check_blade_model(const BladeModel& model);

/// The synthetic rig's figure "scalpel" at true size: 16 cm long, its handle along +x, its edge down.
BladeModel built_in_scalpel();
/// Scale of that figure with which it is 16 cm long.
inline constexpr double kScalpelScale = 0.29;

}  // namespace tactus
