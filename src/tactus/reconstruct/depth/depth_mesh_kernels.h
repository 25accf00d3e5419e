#pragma once
/// Vertices of the extended hull on the measured surface: hull and depth intersected, the smallest parameter
/// per edge [P 1-2].
#include "tactus/reconstruct/depth/depth_kernels.h"
#include "tactus/reconstruct/vertex_kernels.h"

namespace tactus {

/// Moves the vertices of a brick whose edge leaves the measured surface before it leaves the silhouettes.
/// Runs after EmitVertices.
struct CutAtDepth {
  BrickTable table;
  View<const DepthCamera> cameras;
  View<const float> carving;
  View<const std::uint32_t> sub_depth;  ///< 8 per slot
  View<const std::uint32_t> crossings, row_start;
  View<const std::uint64_t> mesh_start;  ///< scanned MeshCounts, per slot
  Vec3f origin_m;
  float voxel_size_m;
  View<Vec3f> positions_m;  ///< in and out

  static constexpr int kThreads = BrickEdges::kMost;
  static constexpr int kSteps = 8, kBisections = 8;
  struct Shared : BrickEdges {
    std::uint32_t cameras[kThreads];  ///< depth cameras that carve near the edge
    float leave[kThreads];            ///< smallest parameter at which a measured surface is left so far
    float inner_D_m[kThreads], outer_D_m[kThreads];
    int chosen[kThreads];
    int chosen_count;
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    std::uint32_t any = 0;
    for (int sub = 0; sub < 8; ++sub) any |= sub_depth[b.index() * 8 + sub];
    if (any == 0) return;
    const Index begin = MeshCount{mesh_start[b.index()]}.vertices();
    const Index total = min(MeshCount{mesh_start[b.index() + 1]}.vertices(), positions_m.size()) - begin;
    s.list(b, crossings, row_start);
    const Vec3i brick = kBrick * table.brick_at(b.index());
    for (Index first = 0; first < total; first += kThreads) {
      const int count = min(total - first, Index{kThreads});
      b.for_threads(count, [&](int t) { load_edge(s, t, first + t, b.index(), brick); });
      for (Index d = 0; d < cameras.size(); ++d) {
        if ((any >> d & 1U) != 0) cut(b, s, count, d);
      }
      b.for_threads(count, [&](int t) { move(s, t, positions_m[begin + first + t]); });
    }
  }

 private:
  TACTUS_HD void load_edge(Shared& s, int t, Index which, Index slot, Vec3i brick) const {
    const BrickEdges::Place place = s.load(t, which, table, slot, brick);
    s.cameras[t] = place.padding ? 0U : sub_depth[slot * 8 + place.sub];
    s.leave[t] = 1;
  }

  template <class Block>
  TACTUS_HD void cut(const Block& b, Shared& s, int count, Index number) const {
    const DepthCamera c = cameras[number];
    const float* pixels = carving.data();
    b.for_threads(count, [&](int t) {
      const bool carves = (s.cameras[t] >> number & 1U) != 0;
      s.outer_D_m[t] = carves ? sample_depth_m(c, pixels, s.at(t, 1.F)) : kUnknownDepth_m;
      s.inner_D_m[t] = carves ? sample_depth_m(c, pixels, s.at(t, 0.F)) : kUnknownDepth_m;
    });
    // One smooth surface changes D along an edge by little more than its length. A larger change is the
    // border of the measurement, or an object before another: not linear, so [P 2] does not hold.
    const float smooth_m = c.voxel_size_m + c.jump_m;
    b.for_threads(count, [&](int t) {
      const float outer = s.outer_D_m[t], inner = s.inner_D_m[t];
      // [P 2]: (P_i + s P_j)/(1+s) with s = |D_i / D_j| lies at t = s/(1+s) = D_i / (D_i - D_j).
      if (outer < 0 && inner - outer <= smooth_m) s.leave[t] = min(s.leave[t], inner / (inner - outer));
    });
    b.compact(
        count, [&](int t) { return s.outer_D_m[t] < 0 && s.inner_D_m[t] - s.outer_D_m[t] > smooth_m; },
        s.chosen, &s.chosen_count);
    b.for_threads(s.chosen_count, [&](int k) {
      const int e = s.chosen[k];
      s.leave[e] = min(s.leave[e], first_free(s, e, c));
    });
  }

  /// Where free space is first measured along the edge: eight samples, then eight bisections.
  TACTUS_HD float first_free(const Shared& s, int e, const DepthCamera& c) const {
    float free = 1;
    for (int k = kSteps - 1; k > 0; --k) {  // from the far end: the sample seen last is the first on the way
      const float at = static_cast<float>(k) / kSteps;
      free = sample_depth_m(c, carving.data(), s.at(e, at)) < 0 ? at : free;
    }
    float kept = free - 1.F / kSteps;
    for (int i = 0; i < kBisections; ++i) {
      const float middle = 0.5F * (kept + free);
      const bool is_free = sample_depth_m(c, carving.data(), s.at(e, middle)) < 0;
      free = is_free ? middle : free;
      kept = is_free ? kept : middle;
    }
    return free;
  }

  TACTUS_HD void move(const Shared& s, int t, Vec3f& position_m) const {
    const Vec3f inner_m = origin_m + voxel_size_m * s.at(t, 0.F), displacement_m = position_m - inner_m;
    const float hull = abs(displacement_m.x + displacement_m.y +
                           displacement_m.z);  // of the edge's axis; the others differ by rounding
    const float leave = clamp(s.leave[t], EmitVertices::kEdgeMargin, 1 - EmitVertices::kEdgeMargin);
    if (s.leave[t] < 1 && leave * voxel_size_m < hull) position_m = origin_m + voxel_size_m * s.at(t, leave);
  }
};

}  // namespace tactus
