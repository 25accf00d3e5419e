#pragma once
/// Meshes with which pictures show the blades that a scene moves.
#include <vector>

#include "tactus/geom/mesh/mesh.h"
#include "tactus/sim/scene.h"

namespace tactus {

/// The steel behind a blade's edge, closed, at a time of its keyframes; of one that is held in its
/// coordinates. Where it cuts it trails in the wound.
TriangleMesh blade_mesh(const BladeDescription& blade, double time_s);

/// Meshes of all blades that follow keyframes, until the end of their paths.
std::vector<TriangleMesh> scripted_blades(const Scene& scene, double time_s);

}  // namespace tactus
