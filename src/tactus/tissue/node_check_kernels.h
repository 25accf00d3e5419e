#pragma once
/// Which nodes of a body are no longer where anything could be.
#include "tactus/frame/frame_params.h"
#include "tactus/geom/arrays/vector_fields.h"
#include "tactus/tissue/node_check_record.h"

namespace tactus {

/// A node is bad whose position or speed is not a number or beyond kMost. One block is 256 nodes.
struct CheckNodes {
  static constexpr int kThreads = 256, kStrip = 16, kStrips = kThreads / kStrip;
  static constexpr float kMost = 1e5F;  ///< m and m/s: no wave in a scene's materials is that fast
  Count nodes;
  View<const Vec3f> x_m, v_m_s;
  View<const Index> only_matched;  ///< per node: 1: in no element; or empty: all are in elements
  View<const Index> cell;          ///< or nodes are in these cells
  NodeFields fields;
  View<NodeCheckRecord> records;
  Index substep;  ///< of the frame or, with `frame`, of its block
  View<const FrameParams> frame = {};
  Index every = 1;  ///< with `frame`: only after so many substeps, and after the last
  TACTUS_HD void load() {
    // After the frame's last block all substeps are done.
    if (!frame.empty()) substep = min(frame[0].done + substep, frame[0].substeps - 1);
  }
  TACTUS_HD bool checks() const {
    return frame.empty() || (substep + 1) % every == 0 || substep + 1 == frame[0].substeps;
  }
  struct Shared {
    float speed2[kThreads];          ///< of bad nodes larger than any other
    float element_speed2[kThreads];  ///< of nodes of elements, else 0
    NodeCheckRecord of_strip[kStrips];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    if (!checks()) return;
    constexpr float kLimit = kMost * kMost, kBad = 4.F * kLimit;
    const Index first = b.index() * kThreads;
    const bool in_cells = fields.cells > 0;
    const int count = min(Index{kThreads}, nodes.get() - first);
    if (count <= 0) return;
    const auto judge = [&](int t, float place2, float speed2, Index is_matched) TACTUS_ALWAYS_INLINE {
      const float known2 = speed2 < kLimit && place2 < kLimit ? speed2 : kBad;
      s.speed2[t] = known2;
      s.element_speed2[t] = known2 == kBad || is_matched != 0 ? 0.F : known2;
    };
    // Each loop for itself, for its lanes.
    if (in_cells) {
      b.for_threads(count, [&](int t) {
        const Vec3f x = fields.position(cell[first + t]), v = fields.velocity(cell[first + t]);
        judge(t, dot(x, x), dot(v, v), 0);
      });
    } else {
      const Vec3f *x = x_m.data() + first, *v = v_m_s.data() + first;
      const auto squared = [](const Vec3f* a, int t) TACTUS_ALWAYS_INLINE {
        return a[t].x * a[t].x + a[t].y * a[t].y + a[t].z * a[t].z;
      };
      if (only_matched.empty()) {
        b.for_threads(count, [&](int t) { judge(t, squared(x, t), squared(v, t), 0); });
      } else {
        const Index* matched = only_matched.data() + first;
        b.for_threads(count, [&](int t) { judge(t, squared(x, t), squared(v, t), matched[t]); });
      }
    }
    const float fastest2 = records[b.index()].fastest2_m2_s2;
    b.for_threads(ceil_div(count, kStrip), [&](int strip) {
      NodeCheckRecord found{};
      const int begin = strip * kStrip, end = min(begin + kStrip, count);
      float most2 = 0, most_element2 = 0;
#pragma omp simd reduction(max : most2, most_element2)
      for (int t = begin; t < end; ++t) {
        most2 = max(most2, s.speed2[t]);
        most_element2 = max(most_element2, s.element_speed2[t]);
      }
      found.fastest_element2_m2_s2 = most_element2;
      // Seldom is a node faster than all were before, or bad.
      for (int t = begin; t < end && most2 > fastest2; ++t) {
        if (s.speed2[t] == kBad && found.bad_node < 0) found.bad_node = first + t;
        if (!(s.speed2[t] > found.fastest2_m2_s2) || s.speed2[t] == kBad) continue;
        found.fastest2_m2_s2 = s.speed2[t];
        found.fastest_node = first + t;
      }
      s.of_strip[strip] = found;
    });
    b.on_one_thread([&] {
      NodeCheckRecord all = records[b.index()];
      for (int strip = 0; strip < ceil_div(count, kStrip); ++strip) {
        const NodeCheckRecord& found = s.of_strip[strip];
        if (found.bad_node >= 0 && all.bad_substep < 0) {
          all.bad_substep = substep;
          all.bad_node = found.bad_node;
        }
        if (found.fastest2_m2_s2 > all.fastest2_m2_s2) {
          all.fastest2_m2_s2 = found.fastest2_m2_s2;
          all.fastest_node = found.fastest_node;
        }
        all.fastest_element2_m2_s2 = max(all.fastest_element2_m2_s2, found.fastest_element2_m2_s2);
      }
      records[b.index()] = all;
    });
  }
};

/// A frame begins.
struct ClearRecords {
  View<NodeCheckRecord> records;
  TACTUS_HD void operator()(Index i) const { records[i] = {}; }
};

}  // namespace tactus
