#pragma once
/// The host's side of depth correction: where the images of all depth cameras lie, their memory on one
/// device, and the launches. Used by VisualHull.
#include <span>
#include <vector>

#include "tactus/compute/exec_context.h"
#include "tactus/geom/camera.h"
#include "tactus/geom/image.h"
#include "tactus/reconstruct/depth_mesh_kernels.h"

namespace tactus {

struct DepthLayout {
  std::vector<DepthCamera> cameras;
  std::vector<Vec3i> tiles;              ///< (camera, first x, first y)
  Index pixels = kDepthTile, cells = 0;  ///< a tile of margin before the first image, and behind the last
  Index buffer_pixels() const { return pixels + kDepthTile; }
  bool empty() const { return cameras.empty(); }

  /// `image` projects padded nodes, `origin_m` is padded node 0. @throws Error naming the camera: a bad one,
  /// an image smaller than 2x2 or larger than 16 megapixels; more than 32 cameras; a jump that is not
  /// positive.
  void add(const Camera& camera, const HullCamera& image, Vec3d origin_m, float voxel_size_m, float jump_m);
  /// Copies an image into the staging memory; what is no distance becomes 0. Empty or null: no measurement.
  /// Returns the number of measured pixels.
  std::int64_t stage(std::size_t camera, const DepthImage* image, float* staging) const;
};

/// Of one device.
struct DepthPart {
  Buffer<DepthCamera> cameras;
  Buffer<Vec3i> tiles;
  HostBuffer<float> staging;
  Buffer<std::uint8_t> holes, tile_holes;
  Buffer<float> raw, usable, carving, low, high;
  Buffer<std::uint32_t> brick_depth, sub_depth;

  void allocate(ExecContext& ctx, const DepthLayout& layout, std::int64_t bricks, Index active_bricks);
  /// Usable pixels, pyramid, and the ramps at holes; `bits` are the prepared silhouettes.
  void prepare(ExecContext& ctx, View<const HullCamera> silhouettes, View<const std::uint32_t> bits);
  /// The vote on the bricks.
  void vote(ExecContext& ctx, const HullGrid& grid, Vec3i blocks, View<Index> active, View<Index> slot);
  void sign(ExecContext& ctx, Count active, const BrickTable& table, View<std::uint8_t> rows);
  /// `emit` is the launch that made the vertices.
  void cut(ExecContext& ctx, Count own, const EmitVertices& emit);
};

}  // namespace tactus
