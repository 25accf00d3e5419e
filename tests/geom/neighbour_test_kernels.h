#pragma once
#include "tactus/geom/search/neighbour_visit.h"

namespace tactus::test {

/// Ids of the particles within reach of each point, in the order of the visit.
struct CollectNear {
  NeighbourCells cells;
  View<const Vec3f> points;
  float reach_m;
  Index capacity;  ///< places in `found` a point
  View<Index> found, count;
  TACTUS_HD void operator()(Index i) const {
    Index n = 0;
    const Vec3f p = points[i];
    cells.for_each_run_around(p, [&](SlotRun run) {
      for (Index slot = run.first; slot < run.last; ++slot) {
        const Vec3f d = cells.particles[slot].x_m - p;
        if (dot(d, d) <= reach_m * reach_m && n < capacity)
          found[i * capacity + n++] = cells.particles[slot].id;
      }
    });
    count[i] = n;
  }
};

/// What depends on which neighbours are visited, in which order and with which weight: s = s/2 + id + d.x + w
/// in floats, by the id of the visitor.
struct OrderedSum {
  template <int kLanes>
  struct Own {
    float sum[kLanes];
    Index count[kLanes];
  };
  View<const SearchParticle> of, among;
  View<float> sum;  ///< by id
  View<Index> count;
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index) const {
    own.sum[t] = 0;
    own.count[t] = 0;
  }
  TACTUS_HD static float weight(float r2_m2, bool near) { return near ? 1.F / (1.F + r2_m2) : 0.F; }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d_m, float, bool near, float weight) const {
    const float next = 0.5F * own.sum[t] + (static_cast<float>(among[j].id) + (d_m.x + weight));
    own.sum[t] = near ? next : own.sum[t];
    own.count[t] += near ? 1 : 0;
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    sum[of[i].id] = own.sum[t];
    count[of[i].id] = own.count[t];
  }
};

/// Ids of every particle's list, by the visitor's id.
struct CollectLists {
  View<const Index> begin, neighbours;
  View<const SearchParticle> of, among;
  Index capacity;
  View<Index> found, count;
  TACTUS_HD void operator()(Index i) const {
    const Index mine = of[i].id;
    Index n = 0;
    for (Index k = begin[i]; k < min(begin[i + 1], neighbours.size()); ++k)
      if (n < capacity) found[mine * capacity + n++] = among[neighbours[k]].id;
    count[mine] = n;
  }
};

}  // namespace tactus::test
