#pragma once
/// Neighbours of every particle, written down: for solvers that go through them many times a step.
#include "tactus/geom/search/neighbour_list_kernels.h"
#include "tactus/geom/search/neighbour_search.h"

namespace tactus {

/// Owns the lists of one search. Call `build` after the search's. Nothing is allocated or read back there.
class NeighbourLists {
 public:
  /// @param max_neighbours of all particles together. Neighbours that there is no capacity for are left out,
  /// from the last particles; see wanted(). @throws Error naming a bad number.
  NeighbourLists(Device& device, Index max_particles, Index max_neighbours);

  /// Slots of `among` within its reach, for every slot of `of`. A particle isn't its own neighbour where the
  /// two are one.
  void build(ExecContext& ctx, const NeighbourSearch& of, const NeighbourSearch& among);
  void build(ExecContext& ctx, const NeighbourSearch& search) { build(ctx, search, search); }

  NeighbourListView view() const { return {begin_.const_view(), neighbours_.const_view()}; }
  /// (1) How many neighbours there are, whether or not there was capacity.
  View<const Index> wanted() const { return wanted_.const_view(); }
  Index max_neighbours() const { return neighbours_.size(); }

 private:
  Buffer<Index> begin_, neighbours_, wanted_;
  TileScan scan_;
};

}  // namespace tactus
