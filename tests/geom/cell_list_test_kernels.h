#pragma once
#include "tactus/geom/search/cell_list.h"

namespace tactus::test {

/// Particles within the radius of each point, in the order of the visit.
struct CollectNear {
  CellListView cells;
  View<const Vec3f> particles, points;
  float radius;
  Index capacity;  ///< places in `found` a point
  View<Index> found, count;
  TACTUS_HD void operator()(Index i) const {
    Index n = 0;
    const Vec3f p = points[i];
    cells.ranges.for_each_slot(p, [&](Index slot) {
      const Index j = cells.order[slot];
      const Vec3f d = particles[j] - p;
      if (dot(d, d) <= radius * radius && n < capacity) found[i * capacity + n++] = j;
    });
    count[i] = n;
  }
};

}  // namespace tactus::test
