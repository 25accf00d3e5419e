#include "tactus/reconstruct/depth/depth_stage.h"

#include <limits>
#include <string>

#include "tactus/base/error.h"
#include "tactus/reconstruct/depth/depth_seam_kernels.h"

namespace tactus {
namespace {
/// Length of the ramp beside a hole. The hull of the paper's eight cameras stands up to a voxel of 100^3 off
/// a sphere of 0.25 m; a longer ramp would be steeper.
constexpr float kFadeVoxels = 1.5F;
}  // namespace

void DepthLayout::add(const Camera& source, const HullCamera& image, Vec3d origin_m, float voxel_size_m,
                      float jump_m) {
  const auto number = static_cast<Index>(cameras.size());
  check_camera(source);
  if (number == kMaxDepthCameras)
    throw Error("depth camera '" + source.name + "': at most " + std::to_string(kMaxDepthCameras) +
                " are possible");
  if (!(jump_m > 0))
    throw usage_error("depth_jump_m " + number_text(jump_m) + ": expected a positive length");
  if (min(source.width_px, source.height_px) < 2 ||
      std::int64_t{source.width_px} * source.height_px > (1 << 24))
    throw Error("depth camera '" + source.name + "': an image of " + std::to_string(source.width_px) + "x" +
                std::to_string(source.height_px) + " pixels; expected 2x2 to 16 megapixels");
  DepthCamera camera{};
  camera.image = image;
  camera.center =
      vec_cast<float>((1 / static_cast<double>(voxel_size_m)) * (source.center_world() - origin_m));
  const auto ray = [&](double u, double v) {
    const double y = (v - source.cy_px) / source.fy_px;
    return transpose(source.T_cam_world.R) *
           Vec3d{(u - source.cx_px - source.skew_px * y) / source.fx_px, y, 1};
  };
  camera.ray = vec_cast<float>(ray(0, 0));
  camera.ray_per_u = vec_cast<float>(ray(1, 0) - ray(0, 0));
  camera.ray_per_v = vec_cast<float>(ray(0, 1) - ray(0, 0));
  camera.voxel_size_m = voxel_size_m;
  camera.jump_m = jump_m;
  camera.fade_m = kFadeVoxels * voxel_size_m;
  camera.begin = pixels;
  camera.row = ceil_div(image.width_px + kDepthPadding, kDepthTile) * kDepthTile;
  pixels += camera.row * image.height_px;
  for (int level = 0; level < kDepthLevels; ++level) {
    const Index cell = 2 << level;
    camera.cells_begin[level] = cells;
    camera.cells_row[level] = ceil_div(image.width_px, cell);
    cells += camera.cells_row[level] * ceil_div(image.height_px, cell);
  }
  for (Index y = 0; y < image.height_px; y += kDepthTile) {
    for (Index x = 0; x < image.width_px; x += kDepthTile) tiles.push_back({number, x, y});
  }
  cameras.push_back(camera);
}

std::int64_t DepthLayout::stage(std::size_t number, const DepthImage* image, float* staging) const {
  const DepthCamera& camera = cameras[number];
  float* to = staging + camera.begin;
  const Index width = camera.image.width_px, height = camera.image.height_px;
  if (image == nullptr || image->empty()) {
    std::fill_n(to, camera.row * height, 0.F);
    return 0;
  }
  Index measured = 0;
  for (Index y = 0; y < height; ++y) {
    const float* from = &(*image)(0, y);
    for (Index x = 0; x < width; ++x) {
      const bool valid = (from[x] > 0) & (from[x] <= std::numeric_limits<float>::max());  // false for NaN
      to[y * camera.row + x] = valid ? from[x] : 0.F;
      measured += valid ? 1 : 0;
    }
  }
  return measured;
}

void DepthPart::set_up(ExecContext& ctx, const DepthLayout& layout) {
  cameras = to_device(ctx, layout.cameras);
  tiles = to_device(ctx, layout.tiles);
  ctx.fill_bytes(usable.view(), 0);  // padding stays so
}

void DepthPart::prepare(ExecContext& ctx) {
  const DepthPart& in = *this;
  ctx.fill_bytes(holes.view(), 0);
  ctx.fill_bytes(tile_holes.view(), 0);
  ctx.parallel_for("depth/prepare", in.tiles.size(),
                   PrepareDepth{in.cameras.view(), in.raw.view(), in.tiles.view(), usable.view(), low.view(),
                                high.view()});
}

void DepthPart::fade(ExecContext& ctx, View<const HullCamera> silhouettes, View<const std::uint32_t> bits) {
  const DepthPart& in = *this;
  ctx.parallel_for(
      "depth/holes", in.tiles.size(),
      FindHoles{in.cameras.view(), silhouettes, bits, in.raw.view(), in.usable.view(), in.low.view(),
                in.high.view(), in.tiles.view(), holes.view(), tile_holes.view()});
  ctx.parallel_for("depth/fade", in.tiles.size(),
                   FadeDepth{in.cameras.view(), in.usable.view(), in.high.view(), in.holes.view(),
                             in.tile_holes.view(), in.tiles.view(), carving.view()});
}

void DepthPart::vote(ExecContext& ctx, const HullGrid& grid, View<std::uint32_t> brick_tiles,
                     View<Index> tile_active) {
  const DepthPart& in = *this;
  ctx.parallel_for("depth/vote", grid.block_count(),
                   VoteDepth{grid, in.cameras.view(), in.low.view(), in.high.view(), brick_tiles, tile_active,
                             block_depth.view()});
}

void DepthPart::sign(ExecContext& ctx, Count held, const BrickTable& table, View<std::uint8_t> rows) {
  const DepthPart& in = *this;
  ctx.parallel_for("depth/signs", held,
                   DepthSigns{table.map.grid, in.cameras.view(), in.carving.view(), in.low.view(),
                              in.high.view(), table.bricks, in.block_depth.view(), rows, sub_depth.view()});
}

void DepthPart::cut(ExecContext& ctx, Count own, const EmitVertices& emit) {
  const DepthPart& in = *this;
  ctx.parallel_for(
      "depth/cut", own,
      CutAtDepth{emit.table, in.cameras.view(), in.carving.view(), in.sub_depth.view(), emit.crossings,
                 emit.row_start, emit.mesh_start, emit.origin_m, emit.voxel_size_m, emit.positions_m});
}

}  // namespace tactus
