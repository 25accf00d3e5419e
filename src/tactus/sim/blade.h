#pragma once
/// Blades of a scene, and the scores of their cuts.
#include <string>
#include <vector>

#include "tactus/sim/scene.h"
#include "tactus/tissue/cut/lattice_cutter.h"

namespace tactus {

/// The edge of a blade at a time of its keyframes.
std::vector<Vec3f> blade_edge_m(const BladeDescription& blade, double time_s);

/// Strip that a blade's edge swept from one time to another; no points outside of its keyframes.
cut::BladeStrip swept(const BladeDescription& blade, double from_s, double to_s, int frame);

/// A blade that didn't cut a body for so long begins a new stroke.
inline constexpr double kStrokePause_s = 0.2;

/// A frame of a stroke in which cubes fell apart.
struct CutStep {
  double displacement_m =
      0;  ///< of the middle of the edge since the last such frame, or in this one if it is the first
  double area_m2 = 0;  ///< of new walls, one side, at rest
};

/// Result of a blade's stroke in a body so far.
struct CutScore {
  std::string blade, body;
  double path_m = 0;              ///< of the middle of the edge, from the first to the last cut
  double depth_m = 0;             ///< of the deepest point of the incision below the surface, at rest
  double area_m2 = 0;             ///< of the incision, one side, at rest
  double begin_s = 0, end_s = 0;  ///< of the first and last frame in which it cut
  Index cut_cubes = 0;
  Index slivers = 0;   ///< parts that had less than 1/64 of a cube, and got as much from the part beside them
  Index stroke = 0;    ///< of the body: 0, 1, ..
  double due_m3 = 0;   ///< blood due from the wound, out or held back; 0 where the body doesn't bleed
  double bled_m3 = 0;  ///< the part of due_m3 that came out
  double pending_m = 0;             ///< way of the edge since cubes fell apart last
  std::vector<CutStep> steps = {};  ///< frame by frame
};

}  // namespace tactus
