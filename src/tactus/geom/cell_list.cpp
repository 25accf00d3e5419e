#include "tactus/geom/cell_list.h"

namespace tactus {
namespace {

CellGrid checked_grid(Index max_particles, float cell_m, int bits_per_axis) {
  if (max_particles <= 0)
    throw Error("cell list: max_particles is " + std::to_string(max_particles) + ", must be > 0");
  if (!(cell_m > 0 && cell_m < 1e6F))
    throw Error("cell list: cell_m is " + std::to_string(cell_m) + ", must be > 0");
  if (bits_per_axis < 2 || bits_per_axis > 8)
    throw Error("cell list: bits_per_axis is " + std::to_string(bits_per_axis) + ", must be 2..8");
  return {1.F / cell_m, bits_per_axis};
}

}  // namespace

CellList::CellList(Device& device, Index max_particles, float cell_m, int bits_per_axis)
    : grid_(checked_grid(max_particles, cell_m, bits_per_axis)),
      keys_(device, max_particles),
      keys_scratch_(device, max_particles),
      order_(device, max_particles),
      order_scratch_(device, max_particles),
      begin_(device, grid_.cell_count()),
      end_(device, grid_.cell_count()) {}

void CellList::build(ExecContext& ctx, View<const Vec3f> x_m, Count count) {
  if (count.capacity > max_particles() || count.capacity > x_m.size()) {
    throw Error("cell list: " + std::to_string(count.capacity) + " particles, but room for " +
                std::to_string(max_particles()) + " and " + std::to_string(x_m.size()) + " positions");
  }
  // A GPU sorts all there is room for (sort_pairs), so there what is behind the count needs the last key.
  const Count keyed = ctx.device().is_cuda() ? Count(max_particles()) : count;
  ctx.parallel_for("cell_list/keys", keyed, CellKeys{grid_, x_m, count, keys_.view(), order_.view()});
  ctx.sort_pairs("cell_list/sort", count, keys_.view(), order_.view(), keys_scratch_.view(),
                 order_scratch_.view(), 3 * grid_.bits + 1);
  find_cell_ranges(ctx, keys_.const_view(), count, grid_, begin_.view(), end_.view());
}

void find_cell_ranges(ExecContext& ctx, View<const std::uint32_t> keys, Count count, const CellGrid& grid,
                      View<Index> begin, View<Index> end) {
  ctx.fill_bytes(begin, 0);
  ctx.fill_bytes(end, 0);
  ctx.parallel_for("cell_list/bounds", count, CellBounds{keys, count, grid.cell_count(), begin, end});
}

}  // namespace tactus
