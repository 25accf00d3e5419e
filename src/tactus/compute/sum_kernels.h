#pragma once
/// Sum by one fixed tree: 256 leaves a chunk, folded in halves. The tree depends on indices only.
#include "tactus/compute/fold.h"

namespace tactus {

inline constexpr int kSumChunk = 256;

struct SumChunk {
  static constexpr int kThreads = kSumChunk;
  struct Shared {
    float value[kSumChunk];
  };
  View<const float> in;
  View<float> out;  ///< one per chunk

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index begin = b.index() * kSumChunk, n = in.size();
    b.for_each_thread([&](int t) { s.value[t] = begin + t < n ? in[begin + t] : 0.F; });
    fold<kSumChunk>(b, kSumChunk, [&](int t, int other) { s.value[t] += s.value[other]; });
    b.for_each_thread([&](int t) {
      if (t == 0) out[b.index()] = s.value[0];
    });
  }
};

}  // namespace tactus
