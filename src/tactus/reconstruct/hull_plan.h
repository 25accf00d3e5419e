#pragma once
/// The decisions of a VisualHull before it allocates: the grid, where all images lie, the capacities for the
/// surface. The same for all devices.
#include <cstdint>
#include <span>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/reconstruct/depth/depth_stage.h"
#include "tactus/reconstruct/hull_kernels.h"
#include "tactus/reconstruct/silhouette_stage.h"

namespace tactus {

struct HullOptions;

struct HullCapacity {
  Index bricks = 0;  ///< slots
  Index vertices = 0, triangles = 0;
};

struct HullPlan {
  HullGrid grid{};
  std::int64_t blocks = 0, tiles = 0;  ///< as the grid says, also where that is too many to be indexed
  Index regions = 0;                   ///< that are sorted before their blocks; 0: all blocks are looked at
  Index tolerated = 0;                 ///< views
  Index min_views = 0;                 ///< fewer see nothing; 0 also where every block is seen by enough
  std::vector<HullCamera> views;       ///< those that count: of silhouettes and of depth
  std::vector<Index> unseen_blocks;    ///< too few see all of them; ...
  std::vector<std::uint32_t> unseen_block_bits;  ///< ... the same, a bit per block
  Vec3i voxels{};
  float voxel_size_m = 0;
  Vec3f origin_m;  ///< of padded node 0
  SilhouetteLayout silhouettes;
  DepthLayout depth;
  HullCapacity capacity;
};

/// @throws Error as the constructor of VisualHull, but for memory.
HullPlan plan_hull(std::span<const Camera> cameras, const HullOptions& options,
                   std::span<const Camera> depth_cameras);

}  // namespace tactus
