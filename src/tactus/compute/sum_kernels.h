#pragma once
/// Sum by one fixed tree: 256 leaves a chunk, folded in halves. The tree depends on indices only.
#include "tactus/compute/kernel.h"

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
    for (int half = kSumChunk / 2; half > 0; half /= 2) {
      b.for_each_thread([&](int t) {
        if (t < half) s.value[t] += s.value[t + half];
      });
    }
    b.for_each_thread([&](int t) {
      if (t == 0) out[b.index()] = s.value[0];
    });
  }
};

}  // namespace tactus
