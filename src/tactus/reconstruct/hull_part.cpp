#include "tactus/reconstruct/hull_part.h"

#include "tactus/reconstruct/tolerant_kernels.h"

namespace tactus {
namespace {

template <class T>
constexpr std::size_t element_bytes(const Buffer<T>&) {
  return sizeof(T);
}

View<const Index> number(View<const PartRange> range, const Index PartRange::*which) {
  return {&(range.data()->*which), 1};
}

View<const Index> number(View<const PartPlace> place, const Index PartPlace::*which) {
  return {&(place.data()->*which), 1};
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

}  // namespace

double HullPart::needed_bytes(const HullPlan& plan) {
  HullPart none;
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

void HullPart::allocate(ExecContext& ctx, const HullPlan& plan, Index part, Index part_count) {
  number = part;
  parts = part_count;
  Device& device = ctx.device();
  each_buffer(plan,
              [&]<class T>(Buffer<T>& buffer, std::int64_t count) { buffer = Buffer<T>(device, count); });
  masks.set_up(ctx, plan.silhouettes);
  cases = to_device(ctx, make_marching_cubes_table());
  range = Buffer<PartRange>(device, 1);
  counts = Buffer<PartCounts>(device, 1);
  if (!plan.depth.empty()) depth.set_up(ctx, plan.depth);
  if (parts == 1) return;
  place = Buffer<PartPlace>(device, 1);
  total = Buffer<PartCounts>(device, 1);
  others = Buffer<PartCounts>(device, parts);
}

BrickTable HullPart::table(const HullPlan& plan) const {
  const BrickMap map{plan.grid, tiles.view(), tile_first.view(), range.view(), plan.capacity.bricks};
  return {map, bricks.view(), rows.view(), sub_cameras.view()};
}
Count HullPart::held(const HullPlan& plan) const {
  return {tactus::number(range.const_view(), &PartRange::held), plan.capacity.bricks};
}
Count HullPart::own(const HullPlan& plan) const {
  return {tactus::number(range.const_view(), &PartRange::own), plan.capacity.bricks};
}

void HullPart::carve(ExecContext& ctx, const HullPlan& plan) {
  const HullPart& in = *this;
  masks.prepare(ctx);
  if (!plan.depth.empty()) depth.prepare(ctx, in.masks.cameras.view(), in.masks.bits.view());
  ctx.parallel_for("hull/classify", plan.grid.block_count(),
                   ClassifyBricks{plan.grid, plan.tolerated, in.masks.cameras.view(), in.masks.cells.view(),
                                  tiles.view(), tile_first.view(), block_cameras.view()});
  if (!plan.depth.empty()) depth.vote(ctx, plan.grid, tiles.view(), tile_first.view());
  ctx.exclusive_scan("hull/scan_tiles", in.tile_first.view(), tile_first.view());
  ctx.parallel_for("hull/partition", 1,
                   PartitionLayers{plan.grid, number, parts, in.tile_first.view(), range.view()});
  ctx.parallel_for("hull/assign_slots", in.tiles.size(),
                   AssignSlots{in.tiles.view(), in.tile_first.view(), in.range.view(), bricks.view()});
  const BrickSigns signs{
      plan.grid,        in.masks.cameras.view(), in.masks.cells.view(), in.masks.bits.view(),
      in.bricks.view(), in.block_cameras.view(), rows.view(),           sub_cameras.view()};
  if (plan.tolerated == 0)
    ctx.parallel_for("hull/signs", held(plan), signs);
  else
    ctx.parallel_for("hull/tolerant_signs", held(plan), TolerantSigns{signs, plan.tolerated});
  if (!plan.depth.empty()) depth.sign(ctx, held(plan), table(plan), rows.view());
}

void HullPart::count(ExecContext& ctx, const HullPlan& plan) {
  const HullPart& in = *this;
  ctx.parallel_for(
      "mesh/count", held(plan),
      CountBrickMesh{table(plan), in.cases.view(), crossings.view(), row_start.view(), mesh_start.view()});
  // Behind the held bricks stand leftovers: they change no sum that is used.
  ctx.exclusive_scan("mesh/scan", in.mesh_start.view(), mesh_start.view());
  ctx.parallel_for("mesh/collect", 1, CollectCounts{in.range.view(), in.mesh_start.view(), counts.view()});
}

void HullPart::find_place(ExecContext& ctx, const Parts<HullPart>& all, bool reads_peers) {
  PlacePart kernel{{}, number, parts, place.view(), total.view()};
  for (Index p = 0; p < parts; ++p) {
    kernel.counts[p] = all[static_cast<std::size_t>(p)].counts.view();
    if (reads_peers) continue;
    const View<PartCounts> copy = others.view().part(p, 1);
    ctx.copy(kernel.counts[p], copy);
    kernel.counts[p] = copy;
  }
  ctx.parallel_for("mesh/place", 1, kernel);
}

void HullPart::emit(ExecContext& ctx, const HullPlan& plan) {
  const HullPart& in = *this;
  const EmitVertices vertices{table(plan),         in.masks.cameras.view(), in.masks.bits.view(),
                              in.crossings.view(), in.row_start.view(),     in.mesh_start.view(),
                              plan.origin_m,       plan.voxel_size_m,       positions_m.view()};
  if (plan.tolerated == 0)
    ctx.parallel_for("mesh/vertices", own(plan), vertices);
  else
    ctx.parallel_for("mesh/tolerant_vertices", own(plan), EmitTolerantVertices{vertices, plan.tolerated});
  if (!plan.depth.empty()) depth.cut(ctx, own(plan), vertices);
  ctx.parallel_for(
      "mesh/triangles", own(plan),
      EmitTriangles{table(plan), in.cases.view(), in.crossings.view(), in.row_start.view(),
                    in.mesh_start.view(), in.place.view(), plan.capacity.vertices, triangles.view()});
}

void push_mesh(ExecContext& ctx, View<const Vec3f> positions_m, View<const Vec3i> triangles,
               View<const PartPlace> place, View<Vec3f> all_positions_m, View<Vec3i> all_triangles) {
  const View<const std::uint32_t> vertex_words = words(positions_m), triangle_words = words(triangles);
  ctx.parallel_for("mesh/push_vertices", Count(number(place, &PartPlace::vertex_words), vertex_words.size()),
                   PushWords{vertex_words, number(place, &PartPlace::vertices), words(all_positions_m)});
  ctx.parallel_for("mesh/push_triangles",
                   Count(number(place, &PartPlace::triangle_words), triangle_words.size()),
                   PushWords{triangle_words, number(place, &PartPlace::triangles), words(all_triangles)});
}

}  // namespace tactus
