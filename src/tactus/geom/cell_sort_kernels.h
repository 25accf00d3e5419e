#pragma once
/// Counting sort of particles by cells: clear, count, scan, spread, rank. Ranks by id make the result the
/// same on every device, whatever order atomics come in.
#include "tactus/compute/atomic.h"
#include "tactus/geom/neighbour_cells.h"
#include "tactus/geom/tile_scan_kernels.h"

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
struct CountInCells {
  CellHash hash;
  View<const Vec3f> x_m;
  View<const Index> table_size;
  View<std::uint32_t> cell, arrival;
  View<Index> begin;  ///< counters here
  TACTUS_HD void operator()(Index i) const {
    const Vec3f p = x_m[i];
    std::uint32_t number = kNoCell;
    if (hash.holds(p)) {
      number = hash.number(hash.cell(p), table_size[0]);
      arrival[i] = atomic_fetch_add(reinterpret_cast<std::uint32_t&>(begin[static_cast<Index>(number)]), 1U);
    }
    cell[i] = number;
  }
};

/// Ids by cells, within a cell in order of arrival.
struct SpreadIds {
  View<const std::uint32_t> cell, arrival;
  View<const Index> id;  ///< empty: a particle's number
  View<const Index> begin;
  View<Index> cell_ids;
  TACTUS_HD void operator()(Index i) const {
    if (cell[i] == kNoCell) return;
    cell_ids[begin[static_cast<Index>(cell[i])] + static_cast<Index>(arrival[i])] = id.empty() ? i : id[i];
  }
};

/// How many ids are compared at once; so many places follow the last id.
inline constexpr Index kRankLanes = 16;

/// Each particle to its slot: after those of its cell with lower ids (of equal ones, in order of arrival).
struct RankInCell {
  View<const std::uint32_t> cell, arrival;
  View<const Vec3f> x_m;
  View<const Index> begin, cell_ids, placed;
  View<SearchParticle> particles;
  View<Index> order, groups;  ///< groups: of kVisitLanes slots each, how many
  TACTUS_HD void operator()(Index i) const {
    if (i == 0) groups[0] = ceil_div(placed[0], kVisitLanes);
    if (cell[i] == kNoCell) return;
    const auto number = static_cast<Index>(cell[i]);
    const Index first = begin[number], last = begin[number + 1];
    const Index place = first + static_cast<Index>(arrival[i]), mine = cell_ids[place];
    Index slot = first;
    for (Index chunk = first; chunk < last; chunk += kRankLanes) {
      Index lower = 0;
#pragma omp simd reduction(+ : lower)
      for (Index t = 0; t < kRankLanes; ++t) {
        const Index other = chunk + t, limit = mine + (other < place ? 1 : 0);
        lower += (other < last ? 1 : 0) & (cell_ids[other] < limit ? 1 : 0);
      }
      slot += lower;
    }
    order[slot] = i;
    particles[slot] = {x_m[i], mine};
  }
};

}  // namespace tactus
