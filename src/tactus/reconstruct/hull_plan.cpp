#include "tactus/reconstruct/hull_plan.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"
#include "tactus/geom/camera/place_limits.h"
#include "tactus/reconstruct/tolerant_kernels.h"
#include "tactus/reconstruct/view_count_kernels.h"
#include "tactus/reconstruct/visual_hull.h"

namespace tactus {
namespace {

constexpr Index kMostVoxels = 1 << 20;  // along a side: numbers of tiles stay exact
/// Blocks that a GPU asks side by side, twice: with fewer, a step more costs more than it saves.
constexpr std::int64_t kManyBlocks = 8448;
/// Vertices and triangles are copied as three words each, which must be indexable.
constexpr Index kMostElements = ((std::int64_t{1} << 31) - 1) / 3;

HullCamera device_camera(const Camera& camera, Vec3d origin_m, double voxel_size_m) {
  HullCamera out{};
  set_projection(out, camera, origin_m, voxel_size_m);
  return out;
}

void check_options(std::span<const Camera> rig, const HullOptions& options) {
  const Vec3f extent = options.workspace_m.extent();
  if (rig.empty()) throw Error("the rig has no cameras: a visual hull needs at least one silhouette");
  if (rig.size() > kMaxCameras)
    throw Error(std::to_string(rig.size()) + " cameras: the visual hull takes at most " +
                std::to_string(kMaxCameras) +
                " (kernels keep them as bits of a word); leave some out of the rig file");
  if (!(extent.x > 0 && extent.y > 0 && extent.z > 0))
    throw Error("the workspace is empty: its max must exceed its min on every axis");
  if (options.resolution <= 0 || options.resolution > kMostVoxels) {
    throw usage_error("resolution " + std::to_string(options.resolution) +
                      ": expected a positive number of voxels along the longest side, at most " +
                      std::to_string(kMostVoxels));
  }
  if (options.slack_px < 0 || options.slack_px > 64)
    throw usage_error("slack of " + std::to_string(options.slack_px) + " px: expected 0 to 64");
  const Index most_tolerated =
      std::min(EmitTolerantVertices::kMostTolerated, static_cast<Index>(rig.size()) - 1);
  if (options.tolerated_views < 0 || options.tolerated_views > most_tolerated) {
    throw usage_error("tolerated views " + std::to_string(options.tolerated_views) + ": expected 0 to " +
                      std::to_string(most_tolerated) + " with " + std::to_string(rig.size()) + " cameras");
  }
  if (options.min_views < 0 || options.min_views > kMaxCameras) {
    throw usage_error("min_views " + std::to_string(options.min_views) + ": expected 0 to " +
                      std::to_string(kMaxCameras));
  }
  const auto check_capacity = [](Index value, Index most, const char* name) {
    if (value < 0 || value > most)
      throw usage_error(std::string(name) + " " + std::to_string(value) +
                        ": expected 0 (from the resolution) to " + std::to_string(most));
  };
  check_capacity(options.max_active_bricks, ((std::int64_t{1} << 31) - 1) / kBrickRows, "max_active_bricks");
  check_capacity(options.max_vertices, kMostElements, "max_vertices");
  check_capacity(options.max_triangles, kMostElements, "max_triangles");
  if (!is_workspace(options.workspace_m)) throw usage_error(std::string("workspace: ") + kWorkspaceRange);
  for (const Camera& camera : rig) check_camera(camera);
}

HullCapacity plan_capacity(const HullOptions& options, Vec3i voxels, std::int64_t bricks) {
  // Surfaces of real scenes cross 1-2 n^2 cells; six faces of the box filled to the brim cross 6 n^2.
  const double area = static_cast<double>(voxels.x) * voxels.y + static_cast<double>(voxels.y) * voxels.z +
                      static_cast<double>(voxels.z) * voxels.x;
  const auto or_from_area = [](Index option, double from_area, double most) {
    return option > 0 ? option : static_cast<Index>(std::min(from_area, most));
  };
  HullCapacity c;
  c.bricks =
      or_from_area(options.max_active_bricks, 0.1 * area + 2000, std::min(static_cast<double>(bricks), 3e7));
  c.vertices = or_from_area(options.max_vertices, 2.5 * area + 20000, 2e8);
  c.triangles = or_from_area(options.max_triangles, 2.0 * c.vertices, kMostElements);
  return c;
}

/// Lists the blocks that too few cameras see whole.
void find_unseen_blocks(Index min_views, HullPlan& plan) {
  for (const HullCamera& c : plan.silhouettes.cameras) plan.views.push_back(c);
  for (const DepthCamera& c : plan.depth.cameras) plan.views.push_back(c.image);
  plan.min_views = std::min(min_views, static_cast<Index>(plan.views.size()) - 1);
  if (plan.min_views <= 0) return;
  const ViewCounter counter{{plan.views.data(), static_cast<Index>(plan.views.size())}, plan.min_views};
  plan.unseen_block_bits.resize(static_cast<std::size_t>(ceil_div(plan.grid.block_count(), 32)));
  for (Index block = 0; block < plan.grid.block_count(); ++block) {
    const Vec3i first = kBrick * kBlockBricks * plan.grid.block_at(block);
    if (counter.ask(first, kBrick * kBlockBricks).is_all_seen(plan.min_views)) continue;
    plan.unseen_blocks.push_back(block);
    plan.unseen_block_bits[static_cast<std::size_t>(block >> 5)] |= 1U << (block & 31);
  }
  if (plan.unseen_blocks.empty()) plan.min_views = 0;
}

}  // namespace

HullPlan plan_hull(std::span<const Camera> cameras, const HullOptions& options,
                   std::span<const Camera> depth_cameras) {
  check_options(cameras, options);
  HullPlan plan;
  plan.tolerated = options.tolerated_views;
  const Vec3d extent = vec_cast<double>(options.workspace_m.extent());
  const double voxel = std::max({extent.x, extent.y, extent.z}) / options.resolution;
  const auto along = [&](double length) { return static_cast<Index>(std::ceil(length / voxel - 1e-4)); };
  plan.voxels = {along(extent.x), along(extent.y), along(extent.z)};
  plan.voxel_size_m = static_cast<float>(voxel);
  const Vec3d origin = vec_cast<double>(options.workspace_m.min) - Vec3d{voxel, voxel, voxel};
  plan.origin_m = vec_cast<float>(origin);
  const Vec3f center = 0.5F * vec_cast<float>(plan.voxels + Vec3i{2, 2, 2});
  for (const Camera& camera : cameras)
    plan.silhouettes.add(device_camera(camera, origin, voxel), center, camera.name);
  for (const Camera& camera : depth_cameras)
    plan.depth.add(camera, device_camera(camera, origin, voxel), origin, plan.voxel_size_m,
                   options.depth_jump_m);

  const auto bricks_along = [](Index cells) { return ceil_div(cells + 2, kBrick); };
  const Vec3i bricks{bricks_along(plan.voxels.x), bricks_along(plan.voxels.y), bricks_along(plan.voxels.z)};
  const auto blocks_along = [](Index n) { return ceil_div(n, kBlockBricks); };
  plan.grid = {bricks,
               {blocks_along(bricks.x), blocks_along(bricks.y), blocks_along(bricks.z)},
               plan.voxels + Vec3i{2, 2, 2}};
  const std::int64_t layer = std::int64_t{plan.grid.blocks.x} * plan.grid.blocks.y;
  plan.blocks = layer * plan.grid.blocks.z;
  plan.tiles = layer * bricks.z;
  const Vec3i regions = plan.grid.regions();
  if (plan.blocks > kManyBlocks) plan.regions = regions.x * regions.y * regions.z;
  if (plan.tiles * kTileBricks < std::int64_t{1} << 31) find_unseen_blocks(options.min_views, plan);
  plan.capacity = plan_capacity(options, plan.voxels, plan.tiles * kTileBricks);
  return plan;
}

}  // namespace tactus
