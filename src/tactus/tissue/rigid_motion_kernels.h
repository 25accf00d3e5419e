#pragma once
/// Sums over a body's nodes that give its motion as a whole.
#include "tactus/compute/kernel.h"
#include "tactus/tissue/motion_sums.h"

namespace tactus {

/// Sums over blocks of nodes. Blocks never cross layers, so slabs of layers have the blocks of the whole
/// body.
struct SumMotion {
  static constexpr int kThreads = 16, kNodes = 256;
  View<const Vec3f> x_m, v_m_s;
  View<const float> mass_kg;
  View<const MotionBlock> blocks;
  View<MotionSums> out;
  struct Shared {
    MotionSums of[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const MotionBlock nodes = blocks[b.index()];
    constexpr Index kStrip = kNodes / kThreads;
    b.for_threads(kThreads, [&](int t) {
      MotionSums sum{};
      const Index begin = min(nodes.begin + t * kStrip, nodes.end), end = min(begin + kStrip, nodes.end);
      for (Index i = begin; i < end; ++i)
        sum.add_node(static_cast<double>(mass_kg[i]), vec_cast<double>(x_m[i]), vec_cast<double>(v_m_s[i]));
      s.of[t] = sum;
    });
    b.on_one_thread([&] {
      MotionSums all = s.of[0];
      for (int t = 1; t < kThreads; ++t) all.add(s.of[t]);
      out[b.index()] = all;
    });
  }
};

}  // namespace tactus
