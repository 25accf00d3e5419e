#pragma once
/// Which vertices of a mesh hang together, found by all threads at once.
#include "tactus/base/math.h"
#include "tactus/compute/atomic.h"
#include "tactus/compute/view.h"

namespace tactus {

/// The forest of a union-find over vertices (Jaiganesh & Burtscher 2018): a parent is never above its child,
/// so the root of a component is its lowest vertex, in any order of threads.
struct VertexForest {
  View<std::uint32_t> parent;
  /// Root of v, or an ancestor of it that was its root a moment ago. Shortens the path.
  TACTUS_HD std::uint32_t find(std::uint32_t v) const {
    std::uint32_t at = atomic_load(parent[static_cast<Index>(v)]), before = v;
    if (at == v) return v;
    for (std::uint32_t next = atomic_load(parent[static_cast<Index>(at)]); next < at;
         next = atomic_load(parent[static_cast<Index>(at)])) {
      atomic_store(parent[static_cast<Index>(before)], next);
      before = at;
      at = next;
    }
    return at;
  }
  TACTUS_HD void join(std::uint32_t a, std::uint32_t b) const {
    a = find(a);
    b = find(b);
    while (a != b) {
      const std::uint32_t high = max(a, b), low = min(a, b);
      const std::uint32_t seen = atomic_replace(parent[static_cast<Index>(high)], high, low);
      if (seen == high) return;
      a = seen;  // another thread was faster: its ancestor is to be joined instead
      b = low;
    }
  }
};

}  // namespace tactus
