#include "tactus/reconstruct/visual_hull.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "tactus/base/error.h"
#include "tactus/geom/mask_growth.h"
#include "tactus/reconstruct/depth_check.h"
#include "tactus/reconstruct/depth_stage.h"
#include "tactus/reconstruct/tolerant_kernels.h"

namespace tactus {
namespace {

constexpr Index kCellRowPixels = PrepareSilhouettes::kMaxCells;
constexpr Index kMaxCells = 65535;  // both halves of a summed cell must hold the count

/// Where the masks of all cameras lie, and which rows and columns the passes over them visit.
struct SilhouetteLayout {
  std::vector<HullCamera> cameras;
  std::vector<Vec2i> cell_rows, cell_columns;
  Index raw_words = 1, bit_words = 0, cell_words = 0;  // a word is read beyond either end of the raw masks
};

/// Largest Index, so that sizes computed in 64 bits can be refused by name.
void check_index(std::int64_t value, const char* what) {
  if (value > (std::int64_t{1} << 31) - 1)
    throw Error(std::string(what) + ": more elements than can be indexed");
}

Index round_up(Index n, Index step) { return ceil_div(n, step) * step; }

HullCamera device_camera(const Camera& camera, Vec3d origin_m, double voxel_size_m) {
  const Mat3d KR = camera.intrinsics() * camera.T_cam_world.R;
  const Vec3d Kt = camera.intrinsics() * camera.T_cam_world.t + KR * origin_m;
  HullCamera out{};
  for (int i = 0; i < 3; ++i) {
    out.row[i] = vec_cast<float>(voxel_size_m * KR.row[i]);
    out.offset[i] = static_cast<float>(Kt[i]);
  }
  out.width_px = camera.width_px;
  out.height_px = camera.height_px;
  return out;
}

void lay_out(SilhouetteLayout& layout, HullCamera camera, const std::string& name) {
  const Index number = static_cast<Index>(layout.cameras.size());
  const Index padded_width = camera.width_px + 2, padded_height = camera.height_px + 2;
  camera.raw_row_words = ceil_div(camera.width_px, 32);
  camera.raw_begin = layout.raw_words;
  camera.bits_row_words = round_up(ceil_div(padded_width, 8), 8);
  camera.bits_begin = layout.bit_words;
  camera.cell_shift = 2;
  const auto cells_along = [&](Index pixels) { return ceil_div(pixels, 1 << camera.cell_shift); };
  while (cells_along(padded_width) * cells_along(padded_height) > kMaxCells ||
         cells_along(padded_width) > kCellRowPixels) {
    if (++camera.cell_shift > 4) {
      throw Error("camera '" + name + "': an image of " + std::to_string(camera.width_px) + "x" +
                  std::to_string(camera.height_px) + " pixels is too large (at most about 16 megapixels)");
    }
  }
  camera.cells_width = cells_along(padded_width);
  camera.cells_height = cells_along(padded_height);
  camera.cells_row = round_up(round_up(camera.cells_width, 8) + 1, SumCellColumns::kColumns);  // whole words
  camera.cells_begin = layout.cell_words;
  layout.raw_words += camera.raw_row_words * camera.height_px;
  layout.bit_words += camera.bits_row_words * ceil_div(padded_height, 2);
  layout.cell_words += camera.cells_row * (camera.cells_height + 1);
  for (Index y = 0; y < camera.cells_height; ++y) layout.cell_rows.push_back({number, y});
  for (Index x = 0; x <= camera.cells_width; x += SumCellColumns::kColumns)
    layout.cell_columns.push_back({number, x});
  layout.cameras.push_back(camera);
}

struct Capacity {
  Index bricks, vertices, triangles;
};

Capacity plan_capacity(const HullOptions& options, Vec3i voxels, std::int64_t brick_count) {
  // Surfaces of real scenes cross 1-2 n^2 cells; six faces of the box filled to the brim cross 6 n^2.
  const double area = static_cast<double>(voxels.x) * voxels.y + static_cast<double>(voxels.y) * voxels.z +
                      static_cast<double>(voxels.z) * voxels.x;
  Capacity c{};
  c.bricks = options.max_active_bricks > 0
                 ? options.max_active_bricks
                 : static_cast<Index>(std::min<double>(static_cast<double>(brick_count), 0.1 * area + 2000));
  c.vertices =
      options.max_vertices > 0 ? options.max_vertices : static_cast<Index>(std::min(2.5 * area + 20000, 2e8));
  c.triangles = options.max_triangles > 0 ? options.max_triangles : 2 * c.vertices;
  return c;
}

/// All memory of one device, and what runs there.
struct Part {
  HullGrid grid{};
  Slab own;
  Vec3i blocks{};
  Capacity capacity{};
  Buffer<HullCamera> cameras;
  Buffer<Vec2i> cell_rows, cell_columns;
  Buffer<CellCase> cases;
  Buffer<std::uint32_t> raw, bits, cells;
  HostBuffer<std::uint32_t> staging;
  Buffer<Index> active, slot, active_bricks, active_count, own_count;
  Buffer<std::uint32_t> brick_cameras, sub_cameras, crossings, row_start;
  Buffer<std::uint8_t> rows;
  Buffer<Index> vertex_start, triangle_start;
  Buffer<Vec3f> positions_m;
  Buffer<Vec3i> triangles;
  Buffer<PartCounts> counts;
  DepthPart depth;
  Event done;
  Replay carve, extract;

  BrickTable table() const {
    return {grid, active_bricks.view(), slot.view(), rows.view(), sub_cameras.view()};
  }
};

}  // namespace

struct VisualHull::Impl {
  DeviceSet& devices;
  std::vector<Camera> cameras, depth_cameras;
  Box3f workspace_m;
  std::string depth_status;
  int slack_px;
  Index tolerated;
  std::vector<BitMask> grown;  ///< silhouettes with their slack
  Vec3i voxels{};
  float voxel_size_m = 0;
  Vec3f origin_m;  ///< of padded node 0
  SilhouetteLayout layout;
  DepthLayout depth;
  Parts<Part> parts;
  // The welded mesh of several parts, on the first device; unused with one part.
  Buffer<Vec3f> all_positions_m;
  Buffer<Vec3i> all_triangles;
  Buffer<PartCounts> part_counts, total;
  /// Copies of the other parts' meshes, where kernels can't read them in place.
  struct PartMesh {
    Buffer<Vec3f> positions_m;
    Buffer<Vec3i> triangles;
  };
  Parts<PartMesh> staged;

  Impl(DeviceSet& set, std::span<const Camera> rig, const HullOptions& options,
       std::span<const Camera> depth_rig);
  void check_sizes(std::span<const BitMask> silhouettes, std::span<const DepthImage> depths_m) const;
  void allocate(Part& part, ExecContext& ctx, const HullOptions& options) const;
  void carve(ExecContext& ctx, Part& part);
  void extract(ExecContext& ctx, Part& part);
  void gather();
  bool welds() const { return parts.size() > 1; }
};

VisualHull::Impl::Impl(DeviceSet& set, std::span<const Camera> rig, const HullOptions& options,
                       std::span<const Camera> depth_rig)
    : devices(set),
      cameras(rig.begin(), rig.end()),
      depth_cameras(depth_rig.begin(), depth_rig.end()),
      workspace_m(options.workspace_m),
      slack_px(options.slack_px),
      tolerated(options.tolerated_views),
      grown(rig.size()) {
  const Vec3d extent = vec_cast<double>(options.workspace_m.extent());
  if (rig.empty()) throw Error("the rig has no cameras: a visual hull needs at least one silhouette");
  if (rig.size() > kMaxCameras)
    throw Error(std::to_string(rig.size()) + " cameras: at most " + std::to_string(kMaxCameras) +
                " are possible");
  if (!(extent.x > 0 && extent.y > 0 && extent.z > 0))
    throw Error("the workspace is empty: its max must exceed its min on every axis");
  if (options.resolution <= 0) {
    throw usage_error("resolution " + std::to_string(options.resolution) +
                      ": expected a positive number of voxels along the longest side");
  }
  if (options.slack_px < 0 || options.slack_px > 64)
    throw usage_error("slack of " + std::to_string(options.slack_px) + " px: expected 0 to 64");
  const Index most_tolerated =
      std::min(EmitTolerantVertices::kMostTolerated, static_cast<Index>(rig.size()) - 1);
  if (tolerated < 0 || tolerated > most_tolerated) {
    throw usage_error("tolerated views " + std::to_string(tolerated) + ": expected 0 to " +
                      std::to_string(most_tolerated) + " with " + std::to_string(rig.size()) + " cameras");
  }
  for (const Camera& camera : rig) check_camera(camera);

  const double voxel = std::max({extent.x, extent.y, extent.z}) / options.resolution;
  const auto along = [&](double length) { return static_cast<Index>(std::ceil(length / voxel - 1e-4)); };
  voxels = {along(extent.x), along(extent.y), along(extent.z)};
  voxel_size_m = static_cast<float>(voxel);
  const Vec3d origin = vec_cast<double>(options.workspace_m.min) - Vec3d{voxel, voxel, voxel};
  origin_m = vec_cast<float>(origin);
  for (const Camera& camera : rig) lay_out(layout, device_camera(camera, origin, voxel), camera.name);
  for (const Camera& camera : depth_rig)
    depth.add(camera, device_camera(camera, origin, voxel), origin, voxel_size_m, options.depth_jump_m);

  const auto bricks_along = [](Index cells) { return ceil_div(cells + 2, kBrick); };
  const Vec3i bricks{bricks_along(voxels.x), bricks_along(voxels.y), bricks_along(voxels.z)};
  const std::vector<Slab> slabs = split_evenly(bricks.z, set.count());
  parts.resize(slabs.size());
  set.for_each_part([&](ExecContext& ctx, int p) {
    Part& part = parts[static_cast<std::size_t>(p)];
    part.own = slabs[static_cast<std::size_t>(p)];
    // Two ghost layers above: triangles use vertices of the first, whose numbering needs signs of the second.
    part.grid = {bricks, voxels + Vec3i{2, 2, 2}, part.own.begin, std::min(part.own.end + 2, bricks.z)};
    const auto blocks_along = [](Index n) { return ceil_div(n, kBlockBricks); };
    part.blocks = {blocks_along(bricks.x), blocks_along(bricks.y),
                   blocks_along(part.grid.layer_end - part.grid.layer_begin)};
    allocate(part, ctx, options);
  });
  if (welds()) {
    Device& first = set.device(0);
    const Capacity capacity = plan_capacity(options, voxels, 0);
    all_positions_m = Buffer<Vec3f>(first, capacity.vertices);
    all_triangles = Buffer<Vec3i>(first, capacity.triangles);
    part_counts = Buffer<PartCounts>(first, set.count());
    total = Buffer<PartCounts>(first, 1);
    if (!set.reads_peers()) {
      for (const Part& part : parts) {
        staged.push_back(
            {Buffer<Vec3f>(first, part.capacity.vertices), Buffer<Vec3i>(first, part.capacity.triangles)});
      }
    }
  }
  set.synchronize();
}

void VisualHull::Impl::allocate(Part& part, ExecContext& ctx, const HullOptions& options) const {
  Device& device = ctx.device();
  const std::int64_t bricks =
      std::int64_t{part.grid.bricks.x} * part.grid.bricks.y * (part.grid.layer_end - part.grid.layer_begin);
  part.capacity = plan_capacity(options, voxels, bricks);
  const Capacity& c = part.capacity;
  const double bytes = 16.0 * static_cast<double>(bricks) + (8.0 + 64 + 32 + 512) * c.bricks +
                       12.0 * c.vertices + 12.0 * c.triangles;
  double memory = 0;
  for (const DeviceInfo& info : list_devices()) {
    if ((info.spec.kind == DeviceKind::cuda) == device.is_cuda())
      memory = std::max(memory, info.memory_bytes);
  }
  if (bytes > 0.9 * memory || bricks > (std::int64_t{1} << 30)) {
    throw Error("resolution " + std::to_string(options.resolution) + " would need " + bytes_text(bytes) +
                " on " + device.name() + ", which has " + bytes_text(memory) +
                "; choose a lower resolution or a smaller workspace");
  }
  check_index(bricks, "bricks");

  part.cameras = to_device(ctx, layout.cameras);
  part.cell_rows = to_device(ctx, layout.cell_rows);
  part.cell_columns = to_device(ctx, layout.cell_columns);
  part.cases = to_device(ctx, make_marching_cubes_table());
  part.staging = HostBuffer<std::uint32_t>(device, layout.raw_words + 1);
  part.raw = Buffer<std::uint32_t>(device, layout.raw_words + 1);
  part.bits = Buffer<std::uint32_t>(device, layout.bit_words);
  part.cells = Buffer<std::uint32_t>(device, layout.cell_words);
  part.active = Buffer<Index>(device, bricks);
  part.slot = Buffer<Index>(device, bricks);
  part.active_bricks = Buffer<Index>(device, bricks);
  part.brick_cameras = Buffer<std::uint32_t>(device, bricks);
  part.active_count = Buffer<Index>(device, 1);
  part.own_count = Buffer<Index>(device, 1);
  part.rows = Buffer<std::uint8_t>(device, std::int64_t{c.bricks} * kBrickRows);
  part.sub_cameras = Buffer<std::uint32_t>(device, std::int64_t{c.bricks} * 8);
  part.crossings = Buffer<std::uint32_t>(device, std::int64_t{c.bricks} * kBrickRows);
  part.row_start = Buffer<std::uint32_t>(device, std::int64_t{c.bricks} * kBrickRows);
  part.vertex_start = Buffer<Index>(device, c.bricks + 1);
  part.triangle_start = Buffer<Index>(device, c.bricks + 1);
  part.positions_m = Buffer<Vec3f>(device, c.vertices);
  part.triangles = Buffer<Vec3i>(device, c.triangles);
  part.counts = Buffer<PartCounts>(device, 1);
  if (!depth.empty()) part.depth.allocate(ctx, depth, bricks, c.bricks);
}

VisualHull::VisualHull(DeviceSet& devices, std::span<const Camera> cameras, const HullOptions& options,
                       std::span<const Camera> depth_cameras)
    : impl_(std::make_unique<Impl>(devices, cameras, options, depth_cameras)) {}
VisualHull::~VisualHull() = default;
VisualHull::VisualHull(VisualHull&&) noexcept = default;

void VisualHull::Impl::check_sizes(std::span<const BitMask> silhouettes,
                                   std::span<const DepthImage> depths_m) const {
  const auto check = [](const Camera& camera, const char* what, Index width_px, Index height_px) {
    if (width_px == camera.width_px && height_px == camera.height_px) return;
    throw Error("camera '" + camera.name + "': the " + what + " has " + std::to_string(width_px) + "x" +
                std::to_string(height_px) + " pixels, its calibration says " +
                std::to_string(camera.width_px) + "x" + std::to_string(camera.height_px));
  };
  if (silhouettes.size() != cameras.size()) {
    throw Error(std::to_string(silhouettes.size()) + " silhouettes for " + std::to_string(cameras.size()) +
                " cameras");
  }
  if (!depths_m.empty() && depths_m.size() != depth_cameras.size()) {
    throw Error(std::to_string(depths_m.size()) + " depth images for " +
                std::to_string(depth_cameras.size()) + " depth cameras");
  }
  for (std::size_t c = 0; c < silhouettes.size(); ++c) {
    const BitMask& mask = silhouettes[c];
    if (!mask.words.empty()) check(cameras[c], "silhouette", mask.width_px, mask.height_px);
  }
  for (std::size_t d = 0; d < depths_m.size(); ++d) {
    const DepthImage& image = depths_m[d];
    if (!image.empty()) check(depth_cameras[d], "depth image", image.width_px, image.height_px);
  }
}

void VisualHull::upload(std::span<const BitMask> silhouettes, std::span<const DepthImage> depths_m) {
  Impl& m = *impl_;
  m.check_sizes(silhouettes, depths_m);
  m.depth_status.clear();
  std::uint32_t used = 0;  // bit d: the image of depth camera d
  const auto note = [&m](const std::string& what) {
    m.depth_status += (m.depth_status.empty() ? "" : "; ") + what;
  };
  for (std::size_t d = 0; d < depths_m.size(); ++d) {
    const std::string odd =
        depth_inconsistency(m.cameras, silhouettes, m.depth_cameras[d], depths_m[d], m.workspace_m);
    if (odd.empty()) used |= 1U << d;
    if (!odd.empty()) note(odd);
  }
  if (m.slack_px > 0) {
    for (std::size_t c = 0; c < silhouettes.size(); ++c) grow_mask(silhouettes[c], m.slack_px, m.grown[c]);
    silhouettes = m.grown;
  }
  m.devices.for_each_part([&](ExecContext& ctx, int p) {
    Part& part = m.parts[static_cast<std::size_t>(p)];
    ctx.synchronize();  // the staging memory may still be on its way from the last frame
    for (std::size_t c = 0; c < silhouettes.size(); ++c) {
      const HullCamera& camera = m.layout.cameras[c];
      std::uint32_t* to = part.staging.data() + camera.raw_begin;
      const std::vector<std::uint32_t>& words = silhouettes[c].words;
      if (words.empty())
        std::fill_n(to, camera.raw_row_words * camera.height_px, ~0U);
      else
        std::copy(words.begin(), words.end(), to);
    }
    ctx.upload(part.staging.span(), part.raw.view());
    if (m.depth.empty()) return;
    for (std::size_t d = 0; d < m.depth_cameras.size(); ++d) {
      const DepthImage* image = (used >> d & 1U) != 0 ? &depths_m[d] : nullptr;
      const std::int64_t measured = m.depth.stage(d, image, part.depth.staging.data());
      if (measured == 0 && p == 0 && image != nullptr && !image->empty())
        note("camera '" + m.depth_cameras[d].name + "': the depth image has no valid pixel");
    }
    ctx.upload(part.depth.staging.span(), part.depth.raw.view());
  });
}

void VisualHull::carve() {
  Impl& m = *impl_;
  m.devices.for_each_part([&](ExecContext& ctx, int p) {
    Part& part = m.parts[static_cast<std::size_t>(p)];
    part.carve.run(ctx, [&] { m.carve(ctx, part); });
  });
}

void VisualHull::Impl::carve(ExecContext& ctx, Part& part) {
  const Part& in = part;
  ctx.parallel_for("hull/prepare_silhouettes", in.cell_rows.size(),
                   PrepareSilhouettes{in.cameras.view(), in.raw.view(), in.cell_rows.view(), part.bits.view(),
                                      part.cells.view()});
  ctx.parallel_for("hull/sum_cell_columns", in.cell_columns.size(),
                   SumCellColumns{in.cameras.view(), in.cell_columns.view(), part.cells.view()});
  if (!depth.empty()) part.depth.prepare(ctx, in.cameras.view(), in.bits.view());
  ctx.parallel_for("hull/classify", in.blocks.x * in.blocks.y * in.blocks.z,
                   ClassifyBricks{in.grid, tolerated, in.blocks, in.cameras.view(), in.cells.view(),
                                  part.active.view(), part.slot.view(), part.brick_cameras.view()});
  if (!depth.empty()) part.depth.vote(ctx, in.grid, in.blocks, part.active.view(), part.slot.view());
  ctx.compact("hull/compact", in.active.view(), part.active_bricks.view(), part.active_count.view());
  ctx.fill_bytes(part.own_count.view(), 0);
  const Count active(in.active_count.view(), in.capacity.bricks);
  ctx.parallel_for("hull/assign_slots", active,
                   AssignSlots{in.grid, in.own.end, in.capacity.bricks, in.active_bricks.view(),
                               in.active_count.view(), part.slot.view(), part.own_count.view()});
  const BrickSigns signs{in.grid,          in.cameras.view(),       in.cells.view(),
                         in.bits.view(),   in.active_bricks.view(), in.brick_cameras.view(),
                         part.rows.view(), part.sub_cameras.view()};
  if (tolerated == 0)
    ctx.parallel_for("hull/signs", active, signs);
  else
    ctx.parallel_for("hull/tolerant_signs", active, TolerantSigns{signs, tolerated});
  if (!depth.empty()) part.depth.sign(ctx, active, in.table(), part.rows.view());
}

void VisualHull::extract() {
  Impl& m = *impl_;
  m.devices.for_each_part([&](ExecContext& ctx, int p) {
    Part& part = m.parts[static_cast<std::size_t>(p)];
    part.extract.run(ctx, [&] { m.extract(ctx, part); });
    ctx.record(part.done);
  });
  if (m.welds()) m.gather();
}

void VisualHull::Impl::extract(ExecContext& ctx, Part& part) {
  const Part& in = part;
  const Count active(in.active_count.view(), in.capacity.bricks),
      own(in.own_count.view(), in.capacity.bricks);
  ctx.fill_bytes(part.vertex_start.view(), 0);
  ctx.fill_bytes(part.triangle_start.view(), 0);
  ctx.parallel_for("mesh/count", active,
                   CountBrickMesh{in.table(), in.cases.view(), part.crossings.view(), part.row_start.view(),
                                  part.vertex_start.view(), part.triangle_start.view()});
  ctx.exclusive_scan("mesh/scan_vertices", in.vertex_start.view(), part.vertex_start.view());
  ctx.exclusive_scan("mesh/scan_triangles", in.triangle_start.view(), part.triangle_start.view());
  const EmitVertices emit{in.table(),
                          in.cameras.view(),
                          in.bits.view(),
                          in.crossings.view(),
                          in.row_start.view(),
                          in.vertex_start.view(),
                          origin_m,
                          voxel_size_m,
                          part.positions_m.view()};
  if (tolerated == 0)
    ctx.parallel_for("mesh/vertices", own, emit);
  else
    ctx.parallel_for("mesh/tolerant_vertices", own, EmitTolerantVertices{emit, tolerated});
  if (!depth.empty()) part.depth.cut(ctx, own, emit);
  ctx.parallel_for("mesh/triangles", own,
                   EmitTriangles{in.table(), in.cases.view(), in.crossings.view(), in.row_start.view(),
                                 in.vertex_start.view(), in.triangle_start.view(), in.capacity.vertices,
                                 part.triangles.view()});
  ctx.parallel_for("mesh/collect", 1,
                   CollectCounts{in.own_count.view(), in.active_count.view(), in.vertex_start.view(),
                                 in.triangle_start.view(), part.counts.view()});
}

void VisualHull::Impl::gather() {
  ExecContext& ctx = devices.context(0);
  for (const Part& part : parts) ctx.wait(part.done);
  for (Index p = 0; p < part_counts.size(); ++p) {
    ctx.copy(parts[static_cast<std::size_t>(p)].counts.const_view(), part_counts.view().part(p, 1));
  }
  const View<const PartCounts> counts = part_counts.const_view();
  for (Index p = 0; p < part_counts.size(); ++p) {
    const Part& part = parts[static_cast<std::size_t>(p)];
    View<const Vec3f> positions_m = part.positions_m.view();
    View<const Vec3i> triangles = part.triangles.view();
    if (!staged.empty()) {
      PartMesh& copy = staged[static_cast<std::size_t>(p)];
      ctx.copy(positions_m, copy.positions_m.view());
      ctx.copy(triangles, copy.triangles.view());
      positions_m = copy.positions_m.view();
      triangles = copy.triangles.view();
    }
    ctx.parallel_for("mesh/gather_vertices",
                     Count(View<const Index>(&counts.data()[p].vertices, 1), part.capacity.vertices),
                     GatherVertices{positions_m, counts, p, all_positions_m.view()});
    ctx.parallel_for("mesh/gather_triangles",
                     Count(View<const Index>(&counts.data()[p].triangles, 1), part.capacity.triangles),
                     GatherTriangles{triangles, counts, p, all_positions_m.size(), all_triangles.view()});
  }
  ctx.parallel_for("mesh/total", 1, SumCounts{counts, total.view()});
}

Count DeviceMesh::vertex_count() const {
  return {View<const Index>(&counts.data()->vertices, 1), positions_m.size()};
}
Count DeviceMesh::triangle_count() const {
  return {View<const Index>(&counts.data()->triangles, 1), triangles.size()};
}

DeviceMesh VisualHull::mesh() const {
  const Impl& m = *impl_;
  if (m.welds()) return {m.all_positions_m.view(), m.all_triangles.view(), m.total.view()};
  const Part& part = m.parts.front();
  return {part.positions_m.view(), part.triangles.view(), part.counts.view()};
}

HullReport VisualHull::report() {
  Impl& m = *impl_;
  HullReport report;
  report.depth = m.depth_status;
  const auto check = [&](Index wanted, Index capacity, const char* what, const char* option) {
    if (wanted <= capacity || !report.overflow.empty()) return;
    report.overflow =
        std::to_string(wanted) + " " + what + ", room for " + std::to_string(capacity) + ": raise " + option;
  };
  m.devices.for_each_part([&](ExecContext& ctx, int p) {
    const Part& part = m.parts[static_cast<std::size_t>(p)];
    const PartCounts counts = to_host(ctx, part.counts.view())[0];
    report.active_bricks += counts.active_bricks;
    report.vertices += counts.vertices;
    report.triangles += counts.triangles;
    check(counts.active_bricks, part.capacity.bricks, "surface bricks", "max_active_bricks");
    check(counts.vertices, part.capacity.vertices, "vertices", "max_vertices");
    check(counts.triangles, part.capacity.triangles, "triangles", "max_triangles");
  });
  m.devices.synchronize();
  const DeviceMesh all = mesh();
  check(report.vertices, all.positions_m.size(), "vertices", "max_vertices");
  check(report.triangles, all.triangles.size(), "triangles", "max_triangles");
  report.vertices = std::min(report.vertices, all.positions_m.size());
  report.triangles = std::min(report.triangles, all.triangles.size());
  return report;
}

TriangleMesh VisualHull::download() {
  const HullReport r = report();
  ExecContext& ctx = impl_->devices.context(0);
  const DeviceMesh device_mesh = mesh();
  TriangleMesh out;
  out.positions_m = to_host(ctx, device_mesh.positions_m.part(0, r.vertices));
  const std::vector<Vec3i> triangles = to_host(ctx, device_mesh.triangles.part(0, r.triangles));
  out.triangles.reserve(triangles.size());
  for (const Vec3i t : triangles) {  // after an overflow some name vertices that are not there, or none
    if (max(t.x, max(t.y, t.z)) < r.vertices && t.x != t.y) out.triangles.push_back({t.x, t.y, t.z});
  }
  return out;
}

float VisualHull::voxel_size_m() const { return impl_->voxel_size_m; }
Vec3i VisualHull::voxel_count() const { return impl_->voxels; }

}  // namespace tactus
