#pragma once
/// Kernels for elements that other parts of a partition have copies of: they update the copies, add the
/// copies' sums to the elements, and mark stale copies.
#include <bit>
#include <cstring>

#include "tactus/compute/kernel.h"

namespace tactus {

/// Elements on one side of a link: those of a list, or so many that follow one another.
struct HaloElements {
  View<const Index> list;  ///< empty: first, first + 1, ...
  Index first = 0;         ///< of a list: subtracted from its numbers
  TACTUS_HD Index at(Index n) const { return list.empty() ? first + n : list[n] - first; }
};

/// to[here] = from[there], of up to two neighbours in one launch.
template <class T, int kFields>
struct PullHalo {
  struct Source {
    View<const T> from[kFields];
    HaloElements there, here;
    Index count = 0;
  };
  Source source[2];
  View<T> to[kFields];
  TACTUS_HD void operator()(Index i) const {
    const bool second = i >= source[0].count;
    const Source& s = source[second ? 1 : 0];
    const Index n = second ? i - source[0].count : i, here = s.here.at(n), there = s.there.at(n);
    for (int f = 0; f < kFields; ++f) to[f][here] = s.from[f][there];
  }
};

/// to[here] += from[there], of one neighbour: two could share an element.
template <class T, int kFields>
struct AddHalo {
  typename PullHalo<T, kFields>::Source source;
  View<T> to[kFields];
  TACTUS_HD void operator()(Index i) const {
    const Index here = source.here.at(i), there = source.there.at(i);
    for (int f = 0; f < kFields; ++f) to[f][here] = to[f][here] + source.from[f][there];
  }
};

/// Copies that are stale, on virtual devices: NaN, or -1.
template <class T, int kFields>
struct PoisonHalo {
  HaloElements here;
  View<T> to[kFields];
  TACTUS_HD void operator()(Index i) const {
    for (int f = 0; f < kFields; ++f) std::memset(static_cast<void*>(&to[f][here.at(i)]), 0xFF, sizeof(T));
  }
};

}  // namespace tactus
