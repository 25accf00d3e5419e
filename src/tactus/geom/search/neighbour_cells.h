#pragma once
/// A neighbour search as kernels see it.
#include "tactus/geom/search/cell_hash.h"

namespace tactus {

/// A particle in the order of the search.
struct alignas(16) SearchParticle {
  Vec3f x_m;
  Index id = 0;  ///< it keeps this for life
};

/// Particles that follow one another and are visited together.
inline constexpr Index kVisitLanes = 8;

/// Slots [first, last).
struct SlotRun {
  Index first = 0, last = 0;
};

/// Particles sorted by cells; within a cell by x, then by id. Particle `slot` of the search was number
/// `order[slot]` of the particles given to it.
struct NeighbourCells {
  CellHash hash;
  View<const Index> table_size, placed;  ///< (1) each; placed: number of slots in use
  View<const Index> begin;               ///< (table_size + 1) first slot of every cell number
  View<const SearchParticle> particles;  ///< by slot
  View<const Index> order;               ///< by slot

  /// f(run) for the cells of a box, by z, y, x, and within a cell by x and id: the same order on every
  /// device. In linear order, a row is one run, or two where the table ends.
  template <class F>
  TACTUS_HD TACTUS_ALWAYS_INLINE void for_each_run(Vec3i low, Vec3i high, F&& f) const {
    const Index size = table_size[0];
    if (hash.ids == CellIds::linear) return for_each_row(low, high, size, f);
    TACTUS_ROLLED
    for (Index z = low.z; z <= high.z; ++z) {
      TACTUS_ROLLED
      for (Index y = low.y; y <= high.y; ++y) {
        TACTUS_ROLLED
        for (Index x = low.x; x <= high.x; ++x) {
          const auto number = static_cast<Index>(hash.number({x, y, z}, size));
          f(SlotRun{begin[number], begin[number + 1]});
        }
      }
    }
  }

  /// Likewise for the 27 cells around a point; none when it is not held.
  template <class F>
  TACTUS_HD TACTUS_ALWAYS_INLINE void for_each_run_around(Vec3f p_m, F&& f) const {
    if (!hash.holds(p_m)) return;
    const Vec3i c = hash.cell(p_m), one{1, 1, 1};
    for_each_run(c - one, c + one, f);
  }

 private:
  struct Row {
    SlotRun run;
    Index beyond;  ///< cells behind the end of the table, which are its first
  };
  TACTUS_HD Row row_at(Vec3i low, Index cells, Index size) const {
    const auto first = static_cast<Index>(hash.number(low, size));
    const Index past = first + cells;
    return {{begin[first], begin[min(past, size)]}, past - size};
  }
  /// The next row is looked up before f(run): a GPU's thread waits for both together.
  template <class F>
  TACTUS_HD TACTUS_ALWAYS_INLINE void for_each_row(Vec3i low, Vec3i high, Index size, F&& f) const {
    const Index cells = high.x - low.x + 1;
    Vec3i at = low;
    Row next = row_at(at, cells, size);
    TACTUS_ROLLED
    for (Index left = (high.y - low.y + 1) * (high.z - low.z + 1); left > 0; --left) {
      const Row row = next;
      at.z += at.y == high.y ? 1 : 0;
      at.y = at.y == high.y ? low.y : at.y + 1;
      if (left > 1) next = row_at(at, cells, size);
      SlotRun run = row.run;
      // At most twice: f is long, and there should be one of it.
      TACTUS_ROLLED
      for (bool wraps = row.beyond > 0;; wraps = false) {
        f(run);
        if (!wraps) break;
        run = {begin[0], begin[row.beyond]};
      }
    }
  }
};

}  // namespace tactus
