#pragma once
/// A labelled volume on the host, for example the organs of a segmented CT.
#include <cstdint>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus {

/// Numbers of labels: TotalSegmentator's go to 117, FreeSurfer's beyond 14,000.
using VoxelLabel = std::uint16_t;
constexpr int kMostLabel = 65535;

/// One label a voxel; voxel (i,j,k) fills origin_m + voxel_size_m * [(i,j,k), (i+1,j+1,k+1)] in the volume's
/// own coordinates, which R_body_volume turns into those of the body.
struct LabelVolume {
  std::vector<VoxelLabel> labels;  ///< x fastest, then y, then z; dims.x*dims.y*dims.z of them
  Vec3i dims{};                    ///< voxels along x, y, z; each >= 1
  Vec3f voxel_size_m{};            ///< edge lengths of a voxel, each > 0
  Vec3f origin_m{};                ///< lowest corner of the volume
  Mat3d R_body_volume = Mat3d::identity();

  /// The label at a point of the body; 0 outside of the volume.
  VoxelLabel at(Vec3d p_body_m) const {
    const Vec3d p_m = transpose(R_body_volume) * p_body_m;
    std::int64_t index = 0;
    for (int a = 2; a >= 0; --a) {
      const double v = (p_m[a] - double{origin_m[a]}) / double{voxel_size_m[a]};
      if (!(v >= 0 && v < dims[a])) return 0;
      index = index * dims[a] + static_cast<std::int64_t>(v);
    }
    return labels[static_cast<std::size_t>(index)];
  }
};

}  // namespace tactus
