#include "tactus/reconstruct/hull_part.h"

#include "tactus/reconstruct/mesh_part_kernels.h"
#include "tactus/reconstruct/tolerant_kernels.h"
#include "tactus/reconstruct/view_count_kernels.h"

namespace tactus {
namespace {

template <class T>
constexpr std::size_t element_bytes(const Buffer<T>&) {
  return sizeof(T);
}

/// One number of a record that a kernel wrote.
template <class T>
View<const Index> number(View<const T> found, const Index T::*which) {
  return {&(found.data()->*which), 1};
}

template <class T>
View<const std::uint32_t> words(View<const T> elements) {
  static_assert(sizeof(T) == 3 * sizeof(std::uint32_t));
  return {reinterpret_cast<const std::uint32_t*>(elements.data()), 3 * elements.size()};
}
template <class T>
View<std::uint32_t> words(View<T> elements) {
  static_assert(sizeof(T) == 3 * sizeof(std::uint32_t));
  return {reinterpret_cast<std::uint32_t*>(elements.data()), 3 * elements.size()};
}

View<std::uint32_t> sign_words(View<std::uint8_t> rows) {
  return {reinterpret_cast<std::uint32_t*>(rows.data()), rows.size() / 4};
}
View<const std::uint32_t> sign_words(View<const std::uint8_t> rows) {
  return {reinterpret_cast<const std::uint32_t*>(rows.data()), rows.size() / 4};
}

}  // namespace

double HullPart::needed_bytes(const HullPlan& plan, HullRole role) {
  HullPart none;
  none.role = role;
  double bytes = 0;
  none.each_buffer(plan, [&](const auto& buffer, std::int64_t count) {
    bytes += static_cast<double>(count) * static_cast<double>(element_bytes(buffer));
  });
  return bytes;
}

std::int64_t HullPart::bytes(const HullPlan& plan) {
  std::int64_t bytes = 0;
  each_buffer(plan, [&](const auto& buffer, std::int64_t) {
    bytes += std::int64_t{buffer.size()} * static_cast<std::int64_t>(element_bytes(buffer));
  });
  return bytes;
}

/// Depth moves vertices after they are made, and that stays within a device.
bool HullPart::keeps_vertices(const HullPlan& plan) const { return keeps_triangles() || !plan.depth.empty(); }

void HullPart::allocate(ExecContext& ctx, const HullPlan& plan, HullRole its_role) {
  role = its_role;
  Device& device = ctx.device();
  each_buffer(plan,
              [&]<class T>(Buffer<T>& buffer, std::int64_t count) { buffer = Buffer<T>(device, count); });
  masks.set_up(ctx, plan.silhouettes);
  cases = to_device(ctx, make_marching_cubes_table());
  if (plan.min_views > 0) {
    views = to_device(ctx, plan.views);
    unseen_blocks = to_device(ctx, plan.unseen_blocks);
    unseen_block_bits = to_device(ctx, plan.unseen_block_bits);
  }
  range = Buffer<PartRange>(device, 1);
  open_blocks = Buffer<Index>(device, 1);
  counts = Buffer<PartCounts>(device, 1);
  side_stream = std::make_unique<SideStream>(device);
  if (!plan.depth.empty()) depth.set_up(ctx, plan.depth);
  if (role.parts == 1) return;
  place = Buffer<PartPlace>(device, 1);
  total = Buffer<PartCounts>(device, 1);
  others = Buffer<PartCounts>(device, role.parts);
}

BrickTable HullPart::table(const HullPlan& plan) const {
  const BrickMap map{plan.grid, tiles.view(), tile_first.view(), range.view(), plan.capacity.bricks};
  return {map, bricks.view(), rows.view(), sub_cameras.view()};
}
Count HullPart::bricks_of(const HullPlan& plan, const Index PartRange::*which) const {
  return {tactus::number(range.const_view(), which), plan.capacity.bricks};
}

void HullPart::prepare(ExecContext& ctx, const HullPlan& plan) {
  const bool has_depth = !plan.depth.empty();
  ExecContext& beside = side_stream->follow(ctx);
  if (plan.regions > 0) beside.fill_bytes(open_blocks.view(), 0);
  masks.prepare_windows(beside);
  if (has_depth) depth.prepare(beside);
  masks.prepare(ctx);
  side_stream->join(ctx);
  if (has_depth) depth.fade(side_stream->follow(ctx), masks.cameras.const_view(), masks.bits.const_view());
  masks.sum_cells(ctx);
}

void HullPart::classify(ExecContext& ctx, const HullPlan& plan) {
  const HullPart& in = *this;
  Count blocks = plan.grid.block_count();
  if (plan.regions > 0) {
    ctx.parallel_for(
        "hull/sort_regions", plan.regions,
        SortRegions{plan.grid, plan.tolerated, in.masks.cameras.view(), in.masks.cells.view(), tiles.view(),
                    block_cameras.view(), tile_first.view(), open_regions.view(), open_blocks.view()});
    blocks = {in.open_blocks.view(), kBlocksOfRegion * plan.regions};
  }
  ctx.parallel_for(
      "hull/classify", blocks,
      ClassifyBricks{plan.grid, plan.tolerated, in.masks.cameras.view(), in.masks.cells.view(), tiles.view(),
                     tile_first.view(), block_cameras.view(), in.open_regions.view()});
}

void HullPart::vote_views(ExecContext& ctx, const HullPlan& plan) {
  if (plan.min_views == 0) return;
  const HullPart& in = *this;
  ctx.parallel_for("hull/views", in.unseen_blocks.size(),
                   VoteViews{plan.grid,
                             {in.views.view(), plan.min_views},
                             in.unseen_blocks.view(),
                             tiles.view(),
                             tile_first.view()});
}

void HullPart::clear_unseen(ExecContext& ctx, const HullPlan& plan, Count carved_bricks) {
  if (plan.min_views == 0) return;
  const HullPart& in = *this;
  ctx.parallel_for("hull/clear_unseen", carved_bricks,
                   ClearUnseen{plan.grid,
                               {in.views.view(), plan.min_views},
                               in.unseen_block_bits.view(),
                               in.bricks.view(),
                               rows.view()});
}

void HullPart::carve(ExecContext& ctx, const HullPlan& plan) {
  const HullPart& in = *this;
  const bool has_depth = !plan.depth.empty();
  prepare(ctx, plan);
  classify(ctx, plan);
  vote_views(ctx, plan);
  if (has_depth) depth.vote(ctx, plan.grid, tiles.view(), tile_first.view());
  ctx.exclusive_scan("hull/scan_tiles", in.tile_first.view(), tile_first.view());
  ctx.parallel_for("hull/assign_slots", in.tiles.size(),
                   AssignSlots{plan.grid, role.number, role.parts, in.tiles.view(), in.tile_first.view(),
                               bricks.view(), range.view()});
  const Count carved_bricks = bricks_of(plan, role.reaches_peers ? &PartRange::own : &PartRange::held);
  const BrickSigns signs{
      plan.grid,        in.masks.cameras.view(), in.masks.cells.view(), in.masks.bits.view(),
      in.bricks.view(), in.block_cameras.view(), rows.view(),           sub_cameras.view()};
  if (plan.tolerated == 0)
    ctx.parallel_for("hull/signs", carved_bricks, signs);
  else
    ctx.parallel_for("hull/tolerant_signs", carved_bricks, TolerantSigns{signs, plan.tolerated});
  clear_unseen(ctx, plan, carved_bricks);
  if (!has_depth) return;
  side_stream->join(ctx);
  depth.sign(ctx, carved_bricks, table(plan), rows.view());
}

void HullPart::fetch_ghosts(ExecContext& ctx, const Parts<HullPart>& all) {
  const HullPart& in = *this;
  FetchGhosts kernel{
      {}, role.number, role.parts, in.tile_first.view(), in.range.view(), sign_words(rows.view())};
  for (std::size_t p = 0; p < all.size(); ++p) kernel.rows[p] = sign_words(all[p].rows.const_view());
  ctx.parallel_for("hull/fetch_ghosts",
                   Count(tactus::number(in.range.view(), &PartRange::ghost_words), kernel.out.size()),
                   kernel);
}

void HullPart::count(ExecContext& ctx, const HullPlan& plan, const Parts<HullPart>& all) {
  const HullPart& in = *this;
  if (role.number + 1 < role.parts && role.reaches_peers) fetch_ghosts(ctx, all);
  ctx.parallel_for(
      "mesh/count", bricks_of(plan, &PartRange::counted),
      CountBrickMesh{table(plan), in.cases.view(), crossings.view(), row_start.view(), mesh_start.view()});
  ctx.parallel_for("mesh/scan", 1, NumberBricks{in.range.view(), mesh_start.view(), counts.view()});
}

void HullPart::find_place(ExecContext& ctx, const Parts<HullPart>& all) {
  PlacePart kernel{{}, role.number, role.parts, place.view(), total.view()};
  for (Index p = 0; p < role.parts; ++p) {
    kernel.counts[p] = all[static_cast<std::size_t>(p)].counts.view();
    if (role.reaches_peers) continue;
    const View<PartCounts> copy = others.view().part(p, 1);
    ctx.copy(kernel.counts[p], copy);
    kernel.counts[p] = copy;
  }
  ctx.parallel_for("mesh/place", 1, kernel);
}

void HullPart::emit(ExecContext& ctx, const HullPlan& plan, HullPart& first) {
  emit_triangles(side_stream->follow(ctx), plan, first);
  emit_vertices(ctx, plan, first);
  side_stream->join(ctx);
}

void HullPart::emit_vertices(ExecContext& ctx, const HullPlan& plan, HullPart& first) {
  const HullPart& in = *this;
  const bool keeps = keeps_vertices(plan);
  const Count own = bricks_of(plan, &PartRange::own);
  const EmitVertices vertices{table(plan),
                              in.masks.cameras.view(),
                              in.masks.bits.view(),
                              in.crossings.view(),
                              in.row_start.view(),
                              in.mesh_start.view(),
                              plan.origin_m,
                              plan.voxel_size_m,
                              keeps ? View<const PartPlace>() : in.place.view(),
                              keeps ? positions_m.view() : first.positions_m.view()};
  if (plan.tolerated == 0)
    ctx.parallel_for("mesh/vertices", own, vertices);
  else
    ctx.parallel_for("mesh/tolerant_vertices", own, EmitTolerantVertices{vertices, plan.tolerated});
  if (plan.depth.empty()) return;
  depth.cut(ctx, own, vertices);
  if (role.number > 0 && role.reaches_peers)
    push_vertices(ctx, in.positions_m.view(), in.place.view(), first.positions_m.view());
}

void HullPart::emit_triangles(ExecContext& ctx, const HullPlan& plan, HullPart& first) {
  const HullPart& in = *this;
  ctx.parallel_for("mesh/triangles", bricks_of(plan, &PartRange::own),
                   EmitTriangles{table(plan), in.cases.view(), in.crossings.view(), in.row_start.view(),
                                 in.mesh_start.view(), in.place.view(), plan.capacity.vertices,
                                 keeps_triangles() ? View<const PartPlace>() : in.place.view(),
                                 keeps_triangles() ? triangles.view() : first.triangles.view()});
}

void push_vertices(ExecContext& ctx, View<const Vec3f> positions_m, View<const PartPlace> place,
                   View<Vec3f> all_positions_m) {
  const View<const std::uint32_t> from = words(positions_m);
  ctx.parallel_for("mesh/push_vertices", Count(number(place, &PartPlace::vertex_words), from.size()),
                   PushWords{from, number(place, &PartPlace::vertices), words(all_positions_m)});
}

void push_triangles(ExecContext& ctx, View<const Vec3i> triangles, View<const PartPlace> place,
                    View<Vec3i> all_triangles) {
  const View<const std::uint32_t> from = words(triangles);
  ctx.parallel_for("mesh/push_triangles", Count(number(place, &PartPlace::triangle_words), from.size()),
                   PushWords{from, number(place, &PartPlace::triangles), words(all_triangles)});
}

}  // namespace tactus
