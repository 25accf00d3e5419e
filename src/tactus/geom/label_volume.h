#pragma once
/// A labelled volume on the host, for example the organs of a segmented CT.
#include <cstdint>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus {

/// Voxels of one byte each. Voxel (i,j,k) fills the box from (i,j,k)*spacing to (i+1,j+1,k+1)*spacing.
struct LabelVolume {
  Vec3i size;                        ///< voxels along x, y, z; each >= 1
  Vec3d spacing_m;                   ///< edge lengths of a voxel [m], each > 0
  std::vector<std::uint8_t> labels;  ///< x fastest, then y, then z; size.x*size.y*size.z of them

  std::size_t index(Index x, Index y, Index z) const {
    const auto nx = static_cast<std::size_t>(size.x), ny = static_cast<std::size_t>(size.y);
    return (static_cast<std::size_t>(z) * ny + static_cast<std::size_t>(y)) * nx +
           static_cast<std::size_t>(x);
  }
  std::uint8_t operator()(Index x, Index y, Index z) const { return labels[index(x, y, z)]; }
  double voxel_volume_m3() const { return spacing_m.x * spacing_m.y * spacing_m.z; }
};

}  // namespace tactus
