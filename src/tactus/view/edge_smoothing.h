#pragma once
/// Smooth edges for pictures drawn with one sample a pixel. Internal to view/.
#include "tactus/geom/image/image.h"

namespace tactus {

/// Follows every edge of brightness to its ends and blends the pixels along it by how far the edge runs
/// through them (FXAA, Lottes 2009, without its filter for single pixels). `out` gets the size of `in`.
void smooth_edges(const ColorImage& in, ColorImage& out);

}  // namespace tactus
