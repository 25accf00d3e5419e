#pragma once
/// A triangle mesh in a device's memory, as makers of surfaces hand it to their users.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// Counts may be known on the device only; the views' sizes are the capacity there is.
struct MeshView {
  View<const Vec3f> positions_m;
  View<const Vec3i> triangles;  ///< counter-clockwise from outside; those of one piece share vertices
  Count vertex_count = 0;
  Count triangle_count = 0;
  View<const Vec3f> normals;  ///< unit, outward, one per vertex; empty: none
};

}  // namespace tactus
