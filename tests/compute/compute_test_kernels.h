#pragma once
#include "tactus/base/math.h"
#include "tactus/compute/kernel.h"

namespace tactus::test {

struct Affine {
  View<const float> x;
  View<float> y;
  float a, b;
  TACTUS_HD void operator()(Index i) const { y[i] = fma(a, x[i], b) / (1.F + x[i] * x[i]); }
};

/// Reverses each run of 64 values through shared memory.
struct ReverseRuns {
  static constexpr int kThreads = 64;
  struct Shared {
    float v[64];
  };
  View<float> x;
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    typename Block::template PerThread<float> kept;
    b.for_each_thread([&](int t) { kept[t] = x[b.index() * 64 + t]; });
    b.for_each_thread([&](int t) { s.v[63 - t] = kept[t]; });
    b.for_each_thread([&](int t) { x[b.index() * 64 + t] = s.v[t]; });
  }
};

}  // namespace tactus::test
