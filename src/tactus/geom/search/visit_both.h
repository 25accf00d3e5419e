#pragma once
/// Two sums over neighbours in one visit.
#include "tactus/geom/search/neighbour_visit.h"

namespace tactus {

/// A pair of VisitNeighbours that does what two do, neither of which has a weight or a load(). A visit costs
/// more than its sums.
template <class A, class B>
struct VisitBoth {
  static constexpr int kAtOnce = 4;
  static_assert(!LoadingKernel<A> && !LoadingKernel<B>);
  template <int kLanes>
  struct Own {
    typename A::template Own<kLanes> a;
    typename B::template Own<kLanes> b;
  };
  A a;
  B b;

  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    a.begin(own.a, t, i);
    b.begin(own.b, t, i);
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float r2_m2, bool near) const {
    a.add(own.a, t, j, d, r2_m2, near);
    b.add(own.b, t, j, d, r2_m2, near);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    a.end(own.a, t, i);
    b.end(own.b, t, i);
  }
};

}  // namespace tactus
