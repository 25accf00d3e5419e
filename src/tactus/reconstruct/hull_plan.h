#pragma once
/// What a VisualHull decides before it allocates: the grid, where the masks of all cameras lie, how much room
/// there is for the surface. The same for all devices.
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/camera.h"
#include "tactus/reconstruct/depth_stage.h"
#include "tactus/reconstruct/hull_kernels.h"

namespace tactus {

struct HullOptions;

/// Where the masks of all cameras lie, and which rows and columns the passes over them visit.
struct SilhouetteLayout {
  std::vector<HullCamera> cameras;
  std::vector<Vec2i> cell_rows, cell_columns, window_rows;
  Index raw_words = 1, bit_words = 0, cell_words = 0;  // a word is read beyond either end of the raw masks

  /// `camera` projects padded nodes; `center` is the middle of the grid. @throws Error for an image of more
  /// than about 16 megapixels.
  void add(HullCamera camera, Vec3f center, const std::string& name);
};

struct HullCapacity {
  Index bricks = 0;  ///< slots
  Index vertices = 0, triangles = 0;
};

struct HullPlan {
  HullGrid grid{};
  std::int64_t blocks = 0, tiles = 0;  ///< as the grid says, also where that is too many to be indexed
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
