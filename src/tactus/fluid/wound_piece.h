#pragma once
/// Pieces of the walls of a cut that bleed.
#include "tactus/base/vec.h"

namespace tactus {

/// A piece of the wall of a cut. Those of both sides are neighbours in a list: 2 k and 2 k + 1. It moves with
/// a cube, or a copy of one: places are in that cube, in spacings.
struct WoundPiece {
  Index node[8] = {};  ///< of the cube, corner q at (q & 1, q >> 1 & 1, q >> 2)
  Vec3f local;
  Vec3f along, across;  ///< of the wall; their cross product points out of the body
  Vec3f rim;            ///< at_skin: half a particle's spacing outside of the skin, beside the cut
  float area_m2 = 0;    ///< at rest
  float factor = 1;     ///< of the rate
  Index stroke = 0;     ///< that made it
  Index at_skin = 0;    ///< 1: it is nearer to the skin than a spacing
};

/// Strokes of a body that have ledgers of their own. Later ones share the last.
inline constexpr Index kStrokes = 64;

}  // namespace tactus
