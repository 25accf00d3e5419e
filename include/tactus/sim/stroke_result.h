#pragma once
/// Results of cuts by blades.
#include <optional>
#include <string>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus {

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

/// A segment of the line in which an incision meets the skin, at rest, world.
struct SkinSegment {
  Vec3d from_m, to_m;
  Vec3d inward{};  ///< unit: in the wall of the incision, across the line, into the body
  /// Beside a planned line, beyond one of its ends, or on another side of the body. elsewhere: nothing is
  /// planned.
  enum class Place : std::uint8_t { elsewhere, beside, beyond } place = Place::elsewhere;
  double off_m = 0;  ///< of its middle from the planned line
};

/// How a cut keeps to the line that was planned for it.
struct LineDeviation {
  double mean_m = 0, max_m = 0;  ///< of the cut from the line, where it is beside it
  double followed_m = 0;         ///< length of the line with a cut within the tolerance
  double beyond_m = 0;           ///< length of the cut beyond the line's ends
};

/// A stroke with all that is measured of it.
struct StrokeResult {
  CutScore score;
  std::vector<SkinSegment> skin;
  std::string plan;  ///< of the body's plans, the one that it kept to best; "": there is none
  std::optional<LineDeviation> deviation;
  double skin_length_m = 0;
  std::optional<double> peak_force_N;  ///< of a body whose `cut_energy_j_m2` is known
};

}  // namespace tactus
