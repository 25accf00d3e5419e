#pragma once
/// What most people write first: every voxel of the grid, every camera, stop at the first that sees
/// background. Kept as the reference that the hull is measured against.
#include <span>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"

namespace tactus::bench {

/// Byte masks, single-precision projection, all cores over slices. 1: inside. n^3 voxels of `box_m`.
class PlainVoxelLoop {
 public:
  PlainVoxelLoop(std::span<const Camera> cameras, std::span<const BitMask> masks, Box3f box_m, Index n);
  void run();
  const std::vector<std::uint8_t>& inside() const { return inside_; }

 private:
  struct View {
    float P[12];
    Index width_px, height_px;
    std::vector<std::uint8_t> mask;
  };
  void run_slice(Index z);

  std::vector<View> views_;
  Box3f box_m_;
  Index n_;
  std::vector<std::uint8_t> inside_;
};

}  // namespace tactus::bench
