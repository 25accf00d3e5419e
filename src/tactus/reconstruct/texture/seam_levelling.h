#pragma once
/// Photos of one surface differ in exposure and light: where triangles are cut from different ones, the seam
/// shows. On the host, for files.
#include "tactus/geom/mesh/textured_mesh.h"

namespace tactus {

struct SeamLevelling {
  /// Seams across which brightness differs by more than this factor are left alone: there one side shows
  /// something else (background at an outline, an object that hides the surface).
  double most_ratio = 2.5;
  double most_gain = 2;  ///< no pixel gets more than that much brighter or darker, per channel
};

/// How much the two sides of the seams differ: root mean square of the logarithm of the ratio of their linear
/// brightness, over those that are levelled.
struct SeamSteps {
  std::size_t seams = 0;  ///< pairs of vertices, one on each side
  double before = 0, after = 0;
};

/// Global levelling (Lempitsky & Ivanov 2007, in the form of Waechter et al. 2014, but multiplicative): each
/// vertex of each photo's part gets a gain per channel so that both sides of a seam are equal, and within a
/// part the logarithm of the gain is as smooth as can be (its Dirichlet energy). Gains are interpolated over
/// triangles and multiply the atlas, in linear light; the details of a photo stay as sharp as they are.
/// Vertices without a photo have their colours multiplied.
/// @throws Error when uv, colours or photos are not one a vertex.
SeamSteps level_seams(TexturedMesh& textured, const SeamLevelling& options = {});

}  // namespace tactus
