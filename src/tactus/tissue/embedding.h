#pragma once
/// Where points of a surface sit in the lattice that moves them.
#include "tactus/base/vec.h"

namespace tactus::embed {

/// Where a vertex sits: a cube and local coordinates, in [0, 1] inside it.
struct Anchor {
  Index cube = 0;
  Vec3f local{};
};

/// Node ids of one cube, corner q at (q & 1, q >> 1 & 1, q >> 2).
struct CubeNodes {
  Index node[8] = {};
};

/// A triangle that a cut adds or changes.
struct TriangleChange {
  Index triangle = 0;
  Index vertex[3] = {};
};

}  // namespace tactus::embed
