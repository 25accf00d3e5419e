#pragma once
/// Checks a finished surface against the silhouettes and the workspace, by a fixed number of its vertices.
#include "tactus/base/vec.h"
#include "tactus/compute/atomic.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// A camera's pinhole and its tiles: squares of `tile_px` pixels, a bit each, row by row.
struct CheckCamera {
  Vec3f row[3];
  float offset[3];
  float tiles_per_px;
  Index width_px, height_px;
  Index tiles_x;     ///< along a row
  Index word_begin;  ///< of its bits
};

/// Sums over the vertices that were looked at.
struct CheckSums {
  std::uint32_t looked_at = 0;
  std::uint32_t on_faces = 0;  ///< within half a voxel of a face of the workspace
  std::uint32_t seen_by_few = 0;
};

/// Marks the tiles that the surface covers in every image. One block takes `kThreads` of `kPerBlock` *
/// blocks vertices, spread evenly over the numbers of all.
struct MarkTiles {
  View<const CheckCamera> cameras;
  View<const Vec3f> positions_m;
  View<const Index> vertex_count;  ///< one
  Index samples;                   ///< most vertices that are looked at
  Vec3f low_m, high_m;             ///< vertices outside of this box lie on a face of the workspace
  Index few;                       ///< a vertex seen by fewer cameras is seen by few
  View<std::uint32_t> tiles;       ///< out, 0 before
  View<CheckSums> sums;            ///< out: one, 0 before

  static constexpr int kThreads = 64, kGrain = 8;
  static constexpr Index kNowhere = -1;
  struct Shared {
    float x[kThreads], y[kThreads], z[kThreads];
    Index tile[kThreads], views[kThreads], on_face[kThreads];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index vertices = min(vertex_count[0], positions_m.size()), taken = min(vertices, samples);
    const Index first = b.index() * kThreads, count = min(taken - first, Index{kThreads});
    if (count <= 0) return;
    b.for_each_thread([&](int t) {
      const std::int64_t number = min(first + t, taken - 1);
      const Vec3f p = positions_m[static_cast<Index>(number * vertices / taken)];
      s.x[t] = p.x;
      s.y[t] = p.y;
      s.z[t] = p.z;
      s.views[t] = 0;
      s.on_face[t] = static_cast<Index>((p.x < low_m.x) | (p.y < low_m.y) | (p.z < low_m.z) |
                                        (p.x > high_m.x) | (p.y > high_m.y) | (p.z > high_m.z));
    });
    for (Index c = 0; c < cameras.size(); ++c) {
      const CheckCamera camera = cameras[c];
      b.for_each_thread([&](int t) TACTUS_ALWAYS_INLINE {
        const auto along = [&](int i) {
          const Vec3f r = camera.row[i];
          return fma(r.x, s.x[t], fma(r.y, s.y[t], fma(r.z, s.z[t], camera.offset[i])));
        };
        const float z = along(2);
        const bool in_front = z > 1e-6F;
        const float inverse_z = 1.F / (in_front ? z : 1.F);
        const float u = fma(along(0), inverse_z, 0.5F), v = fma(along(1), inverse_z, 0.5F);
        const bool seen = in_front & (u >= 0.F) & (v >= 0.F) & (u < static_cast<float>(camera.width_px)) &
                          (v < static_cast<float>(camera.height_px));
        const Index x = static_cast<Index>((seen ? u : 0.F) * camera.tiles_per_px),
                    y = static_cast<Index>((seen ? v : 0.F) * camera.tiles_per_px);
        s.tile[t] = seen ? y * camera.tiles_x + x : kNowhere;
        s.views[t] += static_cast<Index>(seen);
      });
      b.for_threads(count, [&](int t) {
        if (s.tile[t] == kNowhere) return;
        std::uint32_t& word = tiles[camera.word_begin + (s.tile[t] >> 5)];
        const std::uint32_t bit = 1U << (s.tile[t] & 31);
        if ((atomic_load(word) & bit) == 0) atomic_or(word, bit);  // most are marked already
      });
    }
    b.on_one_thread([&] {
      std::uint32_t on_faces = 0, by_few = 0;
      for (int t = 0; t < count; ++t) {
        on_faces += static_cast<std::uint32_t>(s.on_face[t]);
        by_few += s.views[t] < few ? 1U : 0U;
      }
      atomic_add(sums[0].looked_at, static_cast<std::uint32_t>(count));
      if (on_faces != 0) atomic_add(sums[0].on_faces, on_faces);
      if (by_few != 0) atomic_add(sums[0].seen_by_few, by_few);
    });
  }
};

}  // namespace tactus
