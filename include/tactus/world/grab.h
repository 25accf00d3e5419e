#pragma once
/// A point of a body that somebody holds and pulls.
#include <optional>
#include <string>

#include "tactus/base/vec.h"

namespace tactus {

/// A spring from a point of a body's surface to a target. It is shared among the nodes near the point, as
/// fingers that pinch tissue hold more than a point of it. Absent values follow from the material and the
/// lattice.
struct Grab {
  std::string body;
  Vec3d point_m;                   ///< of the surface when the body is grabbed, world; the nearest counts
  Vec3d target_m;                  ///< world, pulls by stiffness times the way of target beyond point
  std::optional<double> radius_m;  ///< of the tissue that is held, at rest; absent: 2 spacings
  std::optional<double> stiffness_N_m;  ///< absent: 8 E radius; a stamp of that radius feels 2.5 E radius
  std::optional<double> max_force_N;    ///< absent: E pi radius^2 / 2, which strains the tissue by half
};

}  // namespace tactus
