#pragma once
/// Points sorted by uniform cells of a table of fixed size: for sparse sets that are queried by others, as
/// samples of a surface are. Particles that are one another's neighbours: neighbour_search.h.
///
/// Cells wrap around: a cell's slot in the table is its integer coordinates modulo 2^bits per axis. So space
/// is unbounded, the table is small, and no two of the 27 cells around a point share a slot. The caller's
/// distance test drops the particles that a far cell brings into a slot.
#include "tactus/compute/buffer.h"
#include "tactus/compute/exec_context.h"
#include "tactus/geom/arrays/tile_scan.h"
#include "tactus/geom/search/cell_list_kernels.h"

namespace tactus {

/// A cell list as kernels read it: `ranges.for_each_slot(p, f)` visits the slots of every particle in the 27
/// cells around p (a superset of those within cell_m; the caller tests distances), in an order that is the
/// same on every device: cells by z, y, x, particles of one cell by number.
struct CellListView {
  CellRanges ranges;
  View<const Index> order;  ///< slot -> particle
};

class CellList {
 public:
  /// @param cell_m edge of a cell [m] = largest distance that one query reaches, > 0
  /// @param bits_per_axis the table has 2^(3 bits) cells; 2..8. About as many as occupied cells is good.
  /// @throws Error naming the bad value.
  CellList(Device& device, Index max_particles, float cell_m, int bits_per_axis = 5);

  /// Sorts the first `count` positions. Particles whose position isn't finite are in no cell.
  /// Nothing is allocated or read back. @throws Error when x_m is shorter than max_particles or count larger.
  void build(ExecContext& ctx, View<const Vec3f> x_m, Count count);

  Index max_particles() const { return order_.size(); }
  const CellGrid& grid() const { return grid_; }
  /// Edge of a cell [m] in the builds from now on, > 0.
  void set_cell_m(float cell_m) { grid_.inverse_cell_1_m = 1 / cell_m; }
  CellListView view() const;
  /// Cell of each of the first `count` slots, ascending; grid().cell_count() for those that are in no cell.
  View<const std::uint32_t> keys() const { return keys_.const_view(); }

 private:
  CellGrid grid_;
  Buffer<std::uint32_t> cell_, arrival_, keys_;
  Buffer<Index> cell_numbers_, order_, begin_, all_;
  TileScan scan_;
};

/// Sets begin/end from the ascending cells of the first `count` slots.
void find_cell_ranges(ExecContext& ctx, View<const std::uint32_t> keys, Count count, const CellGrid& grid,
                      View<Index> begin, View<Index> end);

}  // namespace tactus
