#include "tactus/geom/search/neighbour_search.h"

#include "tactus/geom/arrays/tile_scan_kernels.h"
#include "tactus/geom/search/cell_sort_kernels.h"

namespace tactus {
namespace {

/// Two particles at exactly the reach must be in neighbouring cells although positions over cells are
/// rounded: at 8192 cells from the origin by 2^13 2^-24 of a cell each, two of which are 2^-10.
constexpr float kCellOverReach = 1.F + 1.F / 1024;

CellHash checked_hash(const NeighbourSearchOptions& options) {
  if (options.max_particles <= 0) {
    throw Error("neighbour search: max_particles is " + std::to_string(options.max_particles) +
                ", must be > 0");
  }
  if (!(options.reach_m > 0 && options.reach_m < 1e6F))
    throw Error("neighbour search: reach_m is " + std::to_string(options.reach_m) + ", must be > 0");
  return {1.F / (kCellOverReach * options.reach_m), options.ids};
}

Index given(const NeighbourSearchOptions& options) { return max(options.max_given, options.max_particles); }

}  // namespace

NeighbourSearch::NeighbourSearch(Device& device, const NeighbourSearchOptions& options)
    : hash_(checked_hash(options)),
      reach_m_(options.reach_m),
      cell_(device, given(options)),
      arrival_(device, given(options)),
      begin_(device, CellHash::table_size(given(options)) + 1),
      table_size_(device, 1),
      placed_(device, 1),
      groups_(device, 1),
      keys_(device, options.max_particles + kRankLanes),
      order_(device, options.max_particles),
      particles_(device, options.max_particles + kVisitLanes),
      scan_(device, begin_.size() - 1) {}

void NeighbourSearch::build(ExecContext& ctx, View<const Vec3f> x_m, View<const Index> id, Count count,
                            View<const Index> first_copy) {
  const Index capacity = min(cell_.size(), id.empty() ? x_m.size() : min(x_m.size(), id.size()));
  if (count.capacity > capacity) {
    throw Error("neighbour search: " + std::to_string(count.capacity) + " particles, but capacity for " +
                std::to_string(cell_.size()) + ", " + std::to_string(x_m.size()) + " positions and " +
                (id.empty() ? "no" : std::to_string(id.size())) + " ids");
  }
  first_copy_ = first_copy;
  const Index capacity_cells = CellHash::table_size(count.capacity);
  ctx.parallel_for("search/clear", capacity_cells / kScanTile,
                   ClearCells{count, begin_.view(), table_size_.view(), groups_.view()});
  ctx.parallel_for("search/count", count,
                   CountInCells<HashedNumbers>{
                       {hash_, table_size_.const_view()}, x_m, cell_.view(), arrival_.view(), begin_.view()});
  scan_.run(ctx, "search/scan", Count(table_size_.const_view(), capacity_cells), begin_.view(),
            placed_.view());
  const SlotsByRank<std::int64_t> slots{cell_.const_view(), arrival_.const_view(), begin_.const_view(),
                                        keys_.const_view()};
  ctx.parallel_for("search/spread", count,
                   SpreadKeys{slots.cell, slots.arrival, x_m, id, slots.begin, keys_.view()});
  ctx.parallel_for(
      "search/rank", count,
      SortParticles{slots, x_m, id, placed_.const_view(), particles_.view(), order_.view(), groups_.view()});
}

NeighbourCells NeighbourSearch::cells() const {
  return {hash_,
          table_size_.const_view(),
          placed_.const_view(),
          begin_.const_view(),
          particles_.const_view().part(0, max_particles()),
          order_.const_view()};
}

void NeighbourSearch::reorder(ExecContext& ctx, std::initializer_list<Field> fields) const {
  if (fields.size() > kMostMovedFields) {
    throw Error("neighbour search: " + std::to_string(fields.size()) + " fields to reorder, at most " +
                std::to_string(kMostMovedFields));
  }
  ReorderFields kernel{order_.const_view(), {}, 0};
  for (const Field& field : fields) {
    if (field.capacity < max_particles()) {
      throw Error("neighbour search: a field of " + std::to_string(field.capacity) + " elements, but up to " +
                  std::to_string(max_particles()) + " particles");
    }
    kernel.fields[kernel.field_count++] = field.move;
  }
  ctx.parallel_for("search/reorder", placed(), kernel);
}

}  // namespace tactus
