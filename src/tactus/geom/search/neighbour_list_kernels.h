#pragma once
#include "tactus/geom/search/neighbour_visit.h"

namespace tactus {

struct NeighbourListView {
  View<const Index> begin;       ///< (slots + 1)
  View<const Index> neighbours;  ///< slots, in the order of the visit
  /// f(j) for all neighbours of slot i.
  template <class F>
  TACTUS_HD void for_each(Index i, F&& f) const {
    for (Index k = begin[i], last = min(begin[i + 1], neighbours.size()); k < last; ++k) f(neighbours[k]);
  }
};

struct CountNeighbours {
  template <int kLanes>
  struct Own {
    Index count[kLanes];
  };
  Index self;  ///< 1 where a particle finds itself
  View<Index> count;
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index) const {
    own.count[t] = -self;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index, Vec3f, float, bool near) const {
    own.count[t] += near ? 1 : 0;
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    count[i] = own.count[t];
  }
};

struct WriteNeighbours {
  static constexpr bool kNearOnly = true;
  template <int kLanes>
  struct Own {
    Index next[kLanes], self[kLanes];
  };
  Index self;
  View<const Index> first;
  View<Index> neighbours;
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    own.next[t] = first[i];
    own.self[t] = self != 0 ? i : -1;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f, float, bool) const {
    if (j == own.self[t]) return;
    if (own.next[t] < neighbours.size()) neighbours[own.next[t]] = j;
    ++own.next[t];
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>&, int, Index) const {}
};

}  // namespace tactus
