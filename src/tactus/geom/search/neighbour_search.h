#pragma once
/// Neighbour search among particles that move every substep.
#include <initializer_list>

#include "tactus/compute/buffer.h"
#include "tactus/compute/exec_context.h"
#include "tactus/geom/arrays/tile_scan.h"
#include "tactus/geom/search/neighbour_visit.h"
#include "tactus/geom/search/reorder_kernels.h"

namespace tactus {

struct NeighbourSearchOptions {
  Index max_particles = 0;
  float reach_m = 0;  ///< largest distance between neighbours [m]: the support of a smoothing kernel
  CellIds ids = CellIds::linear;
  Index max_given = 0;  ///< to `build`, with those that have no position; 0: max_particles
};

/// Sorts particles by cells of unbounded space. Owns the sorted positions, ids and order. Call `build`
/// whenever particles have moved, then `visit`, or kernels of your own with `cells()`, and `reorder` for the
/// particles' other fields.
///
/// Nothing is allocated, read back or waited for in a build; it may be captured. Its time follows the number
/// of particles, which the device knows, and not max_particles. Results do not depend on the order in which
/// particles are given, nor on the device.
class NeighbourSearch {
 public:
  /// @throws Error naming the bad option.
  NeighbourSearch(Device& device, const NeighbourSearchOptions& options);

  /// Sorts the first `count` particles. Those whose position is not finite get no slot: see placed().
  /// @param id unique among them; empty: a particle's number
  /// @param first_copy (1) particles given from that number on are copies of other devices' particles: they
  /// are found, but visit_listing and visit_listed leave them out. Empty: none are
  /// @throws Error when there are more than capacity.
  void build(ExecContext& ctx, View<const Vec3f> x_m, View<const Index> id, Count count,
             View<const Index> first_copy = {});

  Index max_particles() const { return order_.size(); }
  float reach_m() const { return reach_m_; }
  /// Particles with a slot: 0 .. placed - 1.
  Count placed() const { return Count(placed_.const_view(), max_particles()); }
  /// The view of the search for kernels.
  NeighbourCells cells() const;

  /// One field in the order of the search: out[slot] = in[order[slot]].
  struct Field {
    template <class T>
    Field(View<const T> in, View<T> out)
        : move{reinterpret_cast<const std::uint32_t*>(in.data()),
               reinterpret_cast<std::uint32_t*>(out.data()), sizeof(T) / sizeof(std::uint32_t)},
          capacity(min(in.size(), out.size())) {
      static_assert(sizeof(T) % sizeof(std::uint32_t) == 0);
    }
    template <class T>
    Field(View<T> in, View<T> out) : Field(View<const T>(in), out) {}
    MovedField move;
    Index capacity;
  };
  /// All in one launch; at most kMostMovedFields.
  void reorder(ExecContext& ctx, std::initializer_list<Field> fields) const;

  /// Visits, for every particle, those of `among` within `among`'s reach; see VisitNeighbours.
  /// VisitNeighbours<Pair> must be listed in a kernels.cu.
  template <class Pair>
  void visit(ExecContext& ctx, const char* name, const NeighbourSearch& among, const Pair& pair) const {
    ctx.parallel_for(name, groups(),
                     VisitNeighbours<Pair>{cells(), among.cells(), sqr(among.reach_m_), pair});
  }
  template <class Pair>
  void visit(ExecContext& ctx, const char* name, const Pair& pair) const {
    visit(ctx, name, *this, pair);
  }
  /// As visit, and lists neighbours for the visits that follow until the next build.
  template <class Pair>
  void visit_listing(ExecContext& ctx, const char* name, const Pair& pair, const NearLists& lists) const {
    ctx.parallel_for(
        name, groups(),
        VisitNeighbours<Pair, ListUse::write>{cells(), cells(), sqr(reach_m_), pair, lists, first_copy_});
  }
  template <class Pair>
  void visit_listed(ExecContext& ctx, const char* name, const Pair& pair, const NearLists& lists) const {
    ctx.parallel_for(
        name, groups(),
        VisitNeighbours<Pair, ListUse::read>{cells(), cells(), sqr(reach_m_), pair, lists, first_copy_});
  }
  /// How many groups of particles VisitNeighbours visits together.
  Count groups() const { return Count(groups_.const_view(), ceil_div(max_particles(), kVisitLanes)); }

 private:
  CellHash hash_;
  float reach_m_;
  Buffer<std::uint32_t> cell_, arrival_;
  Buffer<Index> begin_, table_size_, placed_, groups_;
  Buffer<std::int64_t> keys_;
  Buffer<Index> order_;
  Buffer<SearchParticle> particles_;  ///< and capacity to read eight at once
  TileScan scan_;
  View<const Index> first_copy_;
};

}  // namespace tactus
