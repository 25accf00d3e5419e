#pragma once
/// Where particles come out of an emitter, and in which order.
#include <vector>

#include "tactus/fluid/liquid.h"

namespace tactus {

/// One period of a jet: a cylinder of liquid at rest. The cylinder is cut out of a cubic lattice along one of
/// its vectors, (2, 5, 8), so the lattice goes on from period to period, its planes across the jet are a
/// tenth of a spacing apart, and no layer is seen. The axis is chosen so that the number N of points in a
/// period is the least that is not below the cylinder's volume over d^3; the period is then as long as N d^3
/// over the disc, a little longer than the vector. So an emitter brings pi r^2 v, exactly, at any radius.
struct EmitterPattern {
  std::vector<Vec3f> points_m;  ///< on the disc
  std::vector<float> phases;    ///< 0..1 of the period, ascending
  double period_m = 0;
};
EmitterPattern emitter_pattern(const LiquidEmitter& emitter, float spacing_m);

/// The most that come in a step: in the time in which the jet moves on by two spacings, and some.
Index most_in_a_step(const LiquidEmitter& emitter, float spacing_m);

}  // namespace tactus
