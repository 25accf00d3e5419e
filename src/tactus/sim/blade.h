#pragma once
/// Blades of a scene, and the scores of their cuts.
#include <string>
#include <vector>

#include "tactus/sim/scene.h"
#include "tactus/sim/stroke_result.h"
#include "tactus/tissue/cut/lattice_cutter.h"

namespace tactus {

/// The edge of a blade at a time of its keyframes.
std::vector<Vec3f> blade_edge_m(const BladeDescription& blade, double time_s);

/// Strip that a blade's edge swept from one time to another; no points outside of its keyframes.
cut::BladeStrip swept(const BladeDescription& blade, double from_s, double to_s, int frame);

/// A blade that didn't cut a body for so long begins a new stroke.
inline constexpr double kStrokePause_s = 0.2;

}  // namespace tactus
