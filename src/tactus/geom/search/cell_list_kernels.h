#pragma once
/// Kernels of the cell list, and the cells and ranges that queries read.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// Uniform cells that wrap around every 2^bits cells.
struct CellGrid {
  float inverse_cell_1_m = 1;
  int bits = 5;
  TACTUS_HD constexpr Index cell_count() const { return Index(1) << (3 * bits); }
  /// False for NaN, infinity, and points too far away for integer cells.
  TACTUS_HD bool holds(Vec3f p_m) const {
    const float limit = 1e9F;
    return tactus::abs(p_m.x * inverse_cell_1_m) < limit && tactus::abs(p_m.y * inverse_cell_1_m) < limit &&
           tactus::abs(p_m.z * inverse_cell_1_m) < limit;
  }
  /// Integer cell of a point that the grid holds.
  TACTUS_HD Vec3i cell(Vec3f p_m) const {
    return {floor_to_int(p_m.x * inverse_cell_1_m), floor_to_int(p_m.y * inverse_cell_1_m),
            floor_to_int(p_m.z * inverse_cell_1_m)};
  }
  /// Slot of a cell in the table, x fastest.
  TACTUS_HD constexpr Index wrapped(Vec3i c) const {
    const Index mask = (Index(1) << bits) - 1;
    return (c.x & mask) | ((c.y & mask) << bits) | ((c.z & mask) << (2 * bits));
  }
};

/// Runs of slots by cell.
struct CellRanges {
  CellGrid grid;
  View<const Index> begin, end;  ///< (grid.cell_count()); an empty cell has begin == end
  /// f(slot) for all slots of the 27 cells around p; none when the grid doesn't hold p.
  template <class F>
  TACTUS_HD void for_each_slot(Vec3f p_m, F&& f) const {
    if (!grid.holds(p_m)) return;
    const Vec3i c = grid.cell(p_m);
    for (Index z = c.z - 1; z <= c.z + 1; ++z) {
      for (Index y = c.y - 1; y <= c.y + 1; ++y) {
        // Neighbours along x follow one another in the slots unless the row wraps: one run of three cells.
        const Index w0 = grid.wrapped({c.x - 1, y, z}), w1 = grid.wrapped({c.x, y, z}),
                    w2 = grid.wrapped({c.x + 1, y, z});
        if (w2 - w0 == 2) {
          const Index last = max(end[w0], max(end[w1], end[w2]));
          Index first = begin[w2] < end[w2] ? begin[w2] : last;
          first = begin[w1] < end[w1] ? begin[w1] : first;
          first = begin[w0] < end[w0] ? begin[w0] : first;
          for (Index s = first; s < last; ++s) f(s);
        } else {
          for (Index s = begin[w0]; s < end[w0]; ++s) f(s);
          for (Index s = begin[w1]; s < end[w1]; ++s) f(s);
          for (Index s = begin[w2]; s < end[w2]; ++s) f(s);
        }
      }
    }
  }
};

/// First and last slot of every cell that has any.
struct CellBounds {
  View<const std::uint32_t> keys;
  Count count;
  Index cell_count;
  View<Index> begin, end;
  TACTUS_HD void operator()(Index slot) const {
    const auto key = static_cast<Index>(keys[slot]);
    if (key >= cell_count) return;
    if (slot == 0 || static_cast<Index>(keys[slot - 1]) != key) begin[key] = slot;
    if (slot + 1 == count.get() || static_cast<Index>(keys[slot + 1]) != key) end[key] = slot + 1;
  }
};

}  // namespace tactus
