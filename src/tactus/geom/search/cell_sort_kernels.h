#pragma once
/// Counting sort of particles by cells: clear, count, scan, spread, rank. Ranks by keys that no two particles
/// share make the result the same on every device, whatever order atomics come in.
#include <bit>

#include "tactus/compute/atomic.h"
#include "tactus/geom/arrays/tile_scan_kernels.h"
#include "tactus/geom/search/cell_list_kernels.h"
#include "tactus/geom/search/neighbour_cells.h"

namespace tactus {

inline constexpr std::uint32_t kNoCell = ~0U;
/// Empties the table for the particles of this build. Block: a tile of the largest table.
struct ClearCells {
  static constexpr int kThreads = 256;
  struct Shared {};
  Count count;
  View<Index> begin;  ///< (size of the largest table + 1)
  View<Index> table_size, groups;
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index size = CellHash::table_size(count.get()), first = b.index() * kScanTile;
    if (first >= size) return;
    b.for_range(kScanTile, [&](int i) { begin[first + i] = 0; });
    b.for_threads(1, [&](int) {
      if (first != 0) return;
      table_size[0] = size;
      groups[0] = 0;
    });
  }
};

/// Cell number of every particle, and how many came before it into its cell: any order.
template <class Numbers>
struct CountInCells {
  Numbers cells;  ///< number(p): kNoCell, or below the size of the table
  View<const Vec3f> x_m;
  View<std::uint32_t> cell, arrival;
  View<Index> begin;  ///< counters here
  TACTUS_HD void operator()(Index i) const {
    const std::uint32_t number = cells.number(x_m[i]);
    if (number != kNoCell)
      arrival[i] = atomic_fetch_add(reinterpret_cast<std::uint32_t&>(begin[static_cast<Index>(number)]), 1U);
    cell[i] = number;
  }
};

/// Cell numbers in unbounded space. Positions that the hash does not hold have no cell.
struct HashedNumbers {
  CellHash hash;
  View<const Index> table_size;
  TACTUS_HD std::uint32_t number(Vec3f p_m) const {
    return hash.holds(p_m) ? hash.number(hash.cell(p_m), table_size[0]) : kNoCell;
  }
};

/// Cell numbers in a table of fixed size. Positions that the grid does not hold go into one cell more.
struct WrappedNumbers {
  CellGrid grid;
  TACTUS_HD std::uint32_t number(Vec3f p_m) const {
    return static_cast<std::uint32_t>(grid.holds(p_m) ? grid.wrapped(grid.cell(p_m)) : grid.cell_count());
  }
};

/// Orders the particles of a cell: by x, then by id. So particles that follow one another are near one
/// another.
TACTUS_HD inline std::int64_t key_in_cell(float x_m, Index id) {
  // The bits of floats, as integers, ascend with them; those of negative ones descend.
  const auto bits = std::bit_cast<std::int32_t>(x_m);
  const std::int64_t high = bits < 0 ? bits ^ 0x7fffffff : bits;
  return high * (std::int64_t{1} << 32) + static_cast<std::uint32_t>(id);
}

/// Keys by cells, within a cell in order of arrival.
struct SpreadKeys {
  View<const std::uint32_t> cell, arrival;
  View<const Vec3f> x_m;
  View<const Index> id;  ///< empty: a particle's number
  View<const Index> begin;
  View<std::int64_t> keys;
  TACTUS_HD void operator()(Index i) const {
    if (cell[i] == kNoCell) return;
    keys[begin[static_cast<Index>(cell[i])] + static_cast<Index>(arrival[i])] =
        key_in_cell(x_m[i].x, id.empty() ? i : id[i]);
  }
};
/// Numbers of particles by cells, within a cell in order of arrival.
struct SpreadNumbers {
  View<const std::uint32_t> cell, arrival;
  View<const Index> begin;
  View<Index> numbers;
  TACTUS_HD void operator()(Index i) const {
    if (cell[i] != kNoCell) numbers[begin[static_cast<Index>(cell[i])] + static_cast<Index>(arrival[i])] = i;
  }
};

/// How many keys are compared at once; so many places follow the last key.
inline constexpr Index kRankLanes = 16;

/// Slots by cells, and in a cell by keys.
template <class Key>
struct SlotsByRank {
  View<const std::uint32_t> cell, arrival;
  View<const Index> begin;
  View<const Key> keys;
  /// Slot of particle i, which has a cell: after those of its cell with lower keys (of equal ones, in order
  /// of arrival).
  TACTUS_HD Index slot(Index i, Index number) const {
    const Index first = begin[number], last = begin[number + 1];
    const Index place = first + static_cast<Index>(arrival[i]);
    const Key mine = keys[place];
    Index slot = first;
    for (Index chunk = first; chunk < last; chunk += kRankLanes) {
      Index lower = 0;
#pragma omp simd reduction(+ : lower)
      for (Index t = 0; t < kRankLanes; ++t) {
        const Index other = chunk + t;
        const Key limit = mine + (other < place ? 1 : 0);
        lower += (other < last ? 1 : 0) & (keys[other] < limit ? 1 : 0);
      }
      slot += lower;
    }
    return slot;
  }
};

/// Particles to their slots.
struct SortParticles {
  SlotsByRank<std::int64_t> slots;
  View<const Vec3f> x_m;
  View<const Index> id;  ///< empty: a particle's number
  View<const Index> placed;
  View<SearchParticle> particles;
  View<Index> order, groups;  ///< groups: of kVisitLanes slots each, how many
  TACTUS_HD void operator()(Index i) const {
    if (i == 0) groups[0] = ceil_div(placed[0], kVisitLanes);
    if (slots.cell[i] == kNoCell) return;
    const Index slot = slots.slot(i, static_cast<Index>(slots.cell[i]));
    order[slot] = i;
    particles[slot] = {x_m[i], id.empty() ? i : id[i]};
  }
};

/// Numbers of particles to their slots, and the cell of every slot. Those without a position come last, in
/// order of arrival.
struct SortNumbers {
  SlotsByRank<Index> slots;
  Index cell_count;
  View<std::uint32_t> keys;  ///< by slot
  View<Index> order;
  TACTUS_HD void operator()(Index i) const {
    const auto number = static_cast<Index>(slots.cell[i]);
    const Index slot = number < cell_count ? slots.slot(i, number)
                                           : slots.begin[cell_count] + static_cast<Index>(slots.arrival[i]);
    order[slot] = i;
    keys[slot] = static_cast<std::uint32_t>(number);
  }
};

}  // namespace tactus
