#include "tactus/geom/search/cell_list.h"

#include "tactus/geom/search/cell_sort_kernels.h"

namespace tactus {
namespace {

CellGrid checked_grid(Index max_particles, float cell_m, int bits_per_axis) {
  if (max_particles <= 0)
    throw Error("cell list: max_particles is " + std::to_string(max_particles) + ", must be > 0");
  if (!(cell_m > 0 && cell_m < 1e6F))
    throw Error("cell list: cell_m is " + std::to_string(cell_m) + ", must be > 0 and < 1e6");
  if (bits_per_axis < 2 || bits_per_axis > 8)
    throw Error("cell list: bits_per_axis is " + std::to_string(bits_per_axis) + ", must be 2..8");
  return {1.F / cell_m, bits_per_axis};
}

}  // namespace

CellList::CellList(Device& device, Index max_particles, float cell_m, int bits_per_axis)
    : grid_(checked_grid(max_particles, cell_m, bits_per_axis)),
      cell_(device, max_particles),
      arrival_(device, max_particles),
      keys_(device, max_particles),
      cell_numbers_(device, max_particles + kRankLanes),
      order_(device, max_particles),
      begin_(device, grid_.cell_count() + 2),
      all_(device, 1),
      scan_(device, begin_.size() - 1) {}

void CellList::build(ExecContext& ctx, View<const Vec3f> x_m, Count count) {
  if (count.capacity > max_particles() || count.capacity > x_m.size()) {
    throw Error("cell list: " + std::to_string(count.capacity) + " particles, but capacity for " +
                std::to_string(max_particles()) + " and " + std::to_string(x_m.size()) + " positions");
  }
  ctx.fill_bytes(begin_.view(), 0);
  ctx.parallel_for("cell_list/count", count,
                   CountInCells<WrappedNumbers>{{grid_}, x_m, cell_.view(), arrival_.view(), begin_.view()});
  scan_.run(ctx, "cell_list/scan", begin_.size() - 1, begin_.view(), all_.view());
  const SlotsByRank<Index> slots{cell_.const_view(), arrival_.const_view(), begin_.const_view(),
                                 cell_numbers_.const_view()};
  ctx.parallel_for("cell_list/spread", count,
                   SpreadNumbers{slots.cell, slots.arrival, slots.begin, cell_numbers_.view()});
  ctx.parallel_for("cell_list/rank", count,
                   SortNumbers{slots, grid_.cell_count(), keys_.view(), order_.view()});
}

CellListView CellList::view() const {
  const Index cells = grid_.cell_count();
  return {{grid_, begin_.const_view().part(0, cells), begin_.const_view().part(1, cells)},
          order_.const_view()};
}

void find_cell_ranges(ExecContext& ctx, View<const std::uint32_t> keys, Count count, const CellGrid& grid,
                      View<Index> begin, View<Index> end) {
  ctx.fill_bytes(begin, 0);
  ctx.fill_bytes(end, 0);
  ctx.parallel_for("cell_list/bounds", count, CellBounds{keys, count, grid.cell_count(), begin, end});
}

}  // namespace tactus
