#pragma once
/// The host's side of depth correction: where the images of all depth cameras lie, their memory on one
/// device, and the launches. Used by VisualHull.
#include <span>
#include <vector>

#include "tactus/compute/exec_context.h"
#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"
#include "tactus/reconstruct/depth/depth_mesh_kernels.h"

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
  /// Copies an image into host memory that all devices copy from, buffer_pixels() zeros before; values that
  /// are no distance become 0. Empty or null: no measurement. Returns the number of measured pixels.
  std::int64_t stage(std::size_t camera, const DepthImage* image, float* staging) const;
};

/// Buffers of depth on one device, and their launches.
struct DepthPart {
  Buffer<DepthCamera> cameras;
  Buffer<Vec3i> tiles;
  Buffer<std::uint8_t> holes, tile_holes;
  Buffer<float> raw, usable, carving, low, high;
  Buffer<std::uint32_t> block_depth, sub_depth;

  /// visit(buffer, its number of elements), for all that grow with images or surface.
  template <class F>
  void each_buffer(const DepthLayout& layout, std::int64_t blocks, Index slots, F&& visit) {
    for (Buffer<float>* image : {&raw, &usable, &carving}) visit(*image, layout.buffer_pixels());
    visit(holes, layout.buffer_pixels());
    visit(tile_holes, layout.cells);
    visit(low, layout.cells);
    visit(high, layout.cells);
    visit(block_depth, blocks);
    visit(sub_depth, std::int64_t{slots} * 8);
  }
  /// After the buffers are there.
  void set_up(ExecContext& ctx, const DepthLayout& layout);
  /// Usable pixels and pyramid, which the vote needs.
  void prepare(ExecContext& ctx);
  /// The ramps at holes, which signs and cuts need; `bits` are the prepared silhouettes.
  void fade(ExecContext& ctx, View<const HullCamera> silhouettes, View<const std::uint32_t> bits);
  /// The vote on the bricks.
  void vote(ExecContext& ctx, const HullGrid& grid, View<std::uint32_t> brick_tiles, View<Index> tile_active);
  void sign(ExecContext& ctx, Count held, const BrickTable& table, View<std::uint8_t> rows);
  /// `emit` is the launch that made the vertices.
  void cut(ExecContext& ctx, Count own, const EmitVertices& emit);
};

}  // namespace tactus
