#pragma once
/// Where the vertices of a hull's mesh are: on the silhouettes themselves.
#include "tactus/compute/atomic.h"
#include "tactus/reconstruct/mesh_kernels.h"

namespace tactus {

/// Crossed edges of one brick: all listed in the order of their vertices, and up to kMost of them as ways
/// from the inside to the outside node.
struct BrickEdges {
  static constexpr int kMost = 128;             ///< most bricks have 50 to 100
  std::uint16_t code[3 * kBrickRows * kBrick];  ///< axis << 9 | row << 3 | x
  float inner_x[kMost], inner_y[kMost], inner_z[kMost], step_x[kMost], step_y[kMost],
      step_z[kMost];  ///< in padded node units

  TACTUS_HD Vec3f at(int t, float parameter) const {
    return {fma(parameter, step_x[t], inner_x[t]), fma(parameter, step_y[t], inner_y[t]),
            fma(parameter, step_z[t], inner_z[t])};
  }
  /// Fills `code`. Both views: kBrickRows per slot.
  template <class Block>
  TACTUS_HD void list(const Block& b, View<const std::uint32_t> crossings,
                      View<const std::uint32_t> row_start) {
    const Index first_row = b.index() * kBrickRows;
    b.for_threads(kBrickRows, [&](int t) {
      Index at = static_cast<Index>(row_start[first_row + t] & 0xFFFFU);
      for (std::uint32_t left = crossings[first_row + t]; left != 0; left &= left - 1) {
        const int bit = lowest_bit(left);
        code[at++] = static_cast<std::uint16_t>((bit >> 3) << 9 | t << 3 | (bit & 7));
      }
    });
  }
  struct Place {
    int sub;       ///< sub-brick of the edge's lower node
    bool padding;  ///< the outside node is the box's own boundary: the surface closes just off the last node
  };
  /// Edge number `which` of the list becomes way t; `brick`: the slot's first node.
  TACTUS_HD Place load(int t, Index which, const BrickTable& table, Index slot, Vec3i brick) {
    const int edge = code[which], axis = edge >> 9, row = edge >> 3 & 63, x = edge & 7, y = row & 7,
              z = row >> 3;
    const Vec3i low = brick + Vec3i{x, y, z}, along{axis == 0 ? 1 : 0, axis == 1 ? 1 : 0, axis == 2 ? 1 : 0};
    const bool low_inside = (table.rows[slot * kBrickRows + row] >> x & 1) != 0;
    const Vec3i inner = low_inside ? low : low + along, outer = low_inside ? low + along : low;
    const Vec3i last = table.map.grid.last_node;
    inner_x[t] = static_cast<float>(inner.x);
    inner_y[t] = static_cast<float>(inner.y);
    inner_z[t] = static_cast<float>(inner.z);
    step_x[t] = static_cast<float>(outer.x - inner.x);
    step_y[t] = static_cast<float>(outer.y - inner.y);
    step_z[t] = static_cast<float>(outer.z - inner.z);
    return {(x >> 2) + (y >> 2) * 2 + (z >> 2) * 4, outer.x <= 0 || outer.y <= 0 || outer.z <= 0 ||
                                                        outer.x >= last.x || outer.y >= last.y ||
                                                        outer.z >= last.z};
  }
};

/// Edges whose outside nodes cameras carve, in any order.
template <int kMost>
struct CarvedEdges {
  std::uint32_t count;
  std::uint16_t edge[kMost], camera[kMost];
  float end_value[kMost];  ///< of the camera's silhouette at the outside node
  TACTUS_HD void add(int e, int number, float value) {
    const auto at = atomic_fetch_add(count, 1);
    edge[at] = static_cast<std::uint16_t>(e);
    camera[at] = static_cast<std::uint16_t>(number);
    end_value[at] = value;
  }
};

/// Positions of a brick's vertices: where the edge leaves the first silhouette (method: smallest t over the
/// cameras).
struct EmitVertices {
  BrickTable table;
  View<const HullCamera> cameras;
  View<const std::uint32_t> bits;
  View<const std::uint32_t> crossings, row_start;
  View<const std::uint64_t> mesh_start;  ///< scanned MeshCounts, per slot
  Vec3f origin_m;                        ///< of padded node 0
  float voxel_size_m;
  View<const PartPlace> place;  ///< of this part in `positions_m`; empty: at its beginning
  View<Vec3f> positions_m;      ///< out, maybe in another device's memory

  static constexpr int kThreads = BrickEdges::kMost;
  static constexpr float kEdgeMargin =
      1e-3F;                             ///< vertices stay this far (in edge lengths) from the grid's nodes
  static constexpr int kBisections = 3;  ///< of one pixel step, before the last linear one
  static constexpr int kCamerasAtOnce = 8;
  struct Shared : BrickEdges {
    std::uint32_t cameras[2][kThreads];  ///< that carve near the edge: 32 a word, as wide as a float
    std::uint32_t leave_bits[kThreads];  ///< smallest parameter at which a silhouette is left so far, >= 0
    float end_value[kThreads];           ///< of one camera's silhouette at the outside node
    int carved[kThreads];                ///< edges whose outside node this camera carves
    int carved_count;
    CarvedEdges<kCamerasAtOnce * kThreads> all_carved;  ///< of several cameras, where these share lanes
    float out[3 * kThreads];  ///< positions as they lie in memory: whole lines are written
    TACTUS_HD CameraBits cameras_near(int t) const { return cameras[0][t] | CameraBits{cameras[1][t]} << 32; }
    TACTUS_HD float leave(int t) const { return std::bit_cast<float>(leave_bits[t]); }
  };
  /// Where the vertices of a brick go, and how many of them have capacity.
  struct Run {
    Index begin, count;
  };
  /// Those edges in one image. Homogeneous image points are linear in the 3D parameter, so the perspective
  /// formula t = s z_i / (z_j (1-s) + s z_i) of the image parameter s is built in.
  template <class Block>
  struct Walks {
    typename Block::template PerThread<float> from_x, from_y, from_z, step_x, step_y, step_z;
    typename Block::template PerThread<float> inside_t, inside_value, outside_t, outside_value;
    TACTUS_HD Vec3f at(int t, float parameter) const {
      return {fma(parameter, step_x[t], from_x[t]), fma(parameter, step_y[t], from_y[t]),
              fma(parameter, step_z[t], from_z[t])};
    }
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Run run = run_of(b.index());
    s.list(b, crossings, row_start);
    const Vec3i brick = kBrick * table.brick_at(b.index());
    CameraBits any_camera = 0;
    for (int sub = 0; sub < 8; ++sub) any_camera |= table.sub_cameras[b.index() * 8 + sub];
    for (Index first = 0; first < run.count; first += kThreads) {
      const int count = min(run.count - first, Index{kThreads});
      b.for_threads(count, [&](int t) { load_edge(s, t, first + t, b.index(), brick); });
      if constexpr (Block::kIsLoop) {
        for (CameraBits left = any_camera; left != 0; left &= left - 1)
          carve_edges(b, s, count, brick, lowest_bit(left));
      } else {
        for (CameraBits left = any_camera; left != 0;) left = carve_edges_at_once(b, s, count, brick, left);
      }
      b.for_threads(count, [&](int t) { place_vertex(s, t, s.leave(t)); });
      write(b, s, run.begin + first, count);
    }
  }

  TACTUS_HD Run run_of(Index slot) const {
    const Index before = MeshCount{mesh_start[slot]}.vertices(),
                behind = MeshCount{mesh_start[slot + 1]}.vertices();
    const Index begin = (place.empty() ? 0 : place[0].vertices) + before;
    return {begin, min(behind - before, positions_m.size() - begin)};
  }
  TACTUS_HD void place_vertex(Shared& s, int t, float leave) const {
    leave = clamp(leave, kEdgeMargin, 1 - kEdgeMargin);
    const Vec3f p_m = origin_m + voxel_size_m * s.at(t, leave);
    s.out[3 * t] = p_m.x;
    s.out[3 * t + 1] = p_m.y;
    s.out[3 * t + 2] = p_m.z;
  }
  template <class Block>
  TACTUS_HD void write(const Block& b, const Shared& s, Index begin, int count) const {
    static_assert(sizeof(Vec3f) == 3 * sizeof(float));
    auto* to = reinterpret_cast<float*>(positions_m.data() + begin);
    b.for_range(3 * count, [&](int i) { to[i] = s.out[i]; });
  }

  TACTUS_HD void load_edge(Shared& s, int t, Index which, Index slot, Vec3i brick) const {
    const BrickEdges::Place at = s.load(t, which, table, slot, brick);
    const CameraBits near = at.padding ? 0 : table.sub_cameras[slot * 8 + at.sub];
    s.cameras[0][t] = static_cast<std::uint32_t>(near);
    s.cameras[1][t] = static_cast<std::uint32_t>(near >> 32);
    s.leave_bits[t] = std::bit_cast<std::uint32_t>(at.padding ? 0.F : 1.F);
  }

  /// Pixels that an edge of this brick may cross in the camera's image: as many samples find the first
  /// background pixel.
  TACTUS_HD static int steps_along(const HullCamera& c, Vec3i brick) {
    const Vec3f h = project_node(c, vec_cast<float>(brick) + Vec3f{4, 4, 4});
    const float nearest = h.z - 5 * (abs(c.row[2].x) + abs(c.row[2].y) + abs(c.row[2].z));
    if (!(nearest > 0.1F * h.z)) return 64;  // the camera stands in the brick
    const auto largest = [](Vec3f row) { return max(abs(row.x), max(abs(row.y), abs(row.z))); };
    const float pixels =
        max(largest(c.row[0] - (h.x / h.z) * c.row[2]), largest(c.row[1] - (h.y / h.z) * c.row[2])) / nearest;
    return min(static_cast<int>(pixels) + 1, 256);
  }

  /// Finds the edges whose outside node lies outside this camera's silhouette, and walks those.
  template <class Block>
  TACTUS_HD void carve_edges(const Block& b, Shared& s, int count, Vec3i brick, int number) const {
    const HullCamera c = cameras[number];
    const std::uint32_t* words = bits.data();
    const std::uint32_t* near = s.cameras[number >> 5];
    const std::uint32_t bit = 1U << (number & 31);
    b.for_threads(count, [&](int t) {
      const Vec3f outer{s.inner_x[t] + s.step_x[t], s.inner_y[t] + s.step_y[t], s.inner_z[t] + s.step_z[t]};
      s.end_value[t] = (near[t] & bit) != 0 ? sample_silhouette(c, words, project_node(c, outer)) : 1.F;
    });
    b.compact(
        count, [&](int t) { return s.end_value[t] < 0; }, s.carved, &s.carved_count);
    if (s.carved_count == 0) return;
    walk(
        b, s, s.carved_count, c, steps_along(c, brick), [&](int t) { return s.carved[t]; },
        [&](int t) { return s.end_value[s.carved[t]]; },
        [&](int e, std::uint32_t leave_bits) { s.leave_bits[e] = min(s.leave_bits[e], leave_bits); });
  }

  /// Likewise for several cameras at once, where a walk waits for memory: every lane has an edge and a camera
  /// of its own. @returns those that are left
  template <class Block>
  TACTUS_HD CameraBits carve_edges_at_once(const Block& b, Shared& s, int count, Vec3i brick,
                                           CameraBits left) const {
    CameraBits now = 0;
    for (int k = 0; k < kCamerasAtOnce && left != 0; ++k, left &= left - 1) now |= left & (~left + 1);
    const std::uint32_t* words = bits.data();
    auto& all = s.all_carved;
    b.on_one_thread([&] { all.count = 0; });
    b.for_threads(count, [&](int t) {
      const Vec3f outer = s.at(t, 1.F);
      for (CameraBits near = s.cameras_near(t) & now; near != 0; near &= near - 1) {
        const int number = lowest_bit(near);
        const HullCamera& c = cameras[number];
        const float value = sample_silhouette(c, words, project_node(c, outer));
        if (value < 0) all.add(t, number, value);
      }
    });
    const int carved = static_cast<int>(all.count);
    b.for_range(carved, [&](int k) {
      const HullCamera c = cameras[all.camera[k]];
      const int first = k - k % kThreads;
      walk(
          b, s, min(carved - first, kThreads), c, steps_along(c, brick),
          [&](int t) { return static_cast<int>(all.edge[first + t]); },
          [&](int t) { return all.end_value[first + t]; },
          [&](int e, std::uint32_t leave_bits) { atomic_min(s.leave_bits[e], leave_bits); });
    });
    return left;
  }

  /// Walks projected edges pixel by pixel to the first background sample, then refines to sub-pixel.
  /// @param edge_of(t), end_value_of(t) of the t-th @param report(edge, bits of the parameter where it
  /// leaves)
  template <class Block, class Edge, class Value, class Report>
  TACTUS_HD void walk(const Block& b, Shared& s, int count, const HullCamera& c, int steps, Edge&& edge_of,
                      Value&& end_value_of, Report&& report) const {
    const std::uint32_t* words = bits.data();
    const float stride = 1.F / static_cast<float>(steps);
    Walks<Block> w;
    b.for_own(count, [&](int t) {
      const int e = edge_of(t);
      const Vec3f inner{s.inner_x[e], s.inner_y[e], s.inner_z[e]};
      const Vec3f from = project_node(c, inner),
                  to = project_node(c, inner + Vec3f{s.step_x[e], s.step_y[e], s.step_z[e]});
      w.from_x[t] = from.x;
      w.from_y[t] = from.y;
      w.from_z[t] = from.z;
      w.step_x[t] = to.x - from.x;
      w.step_y[t] = to.y - from.y;
      w.step_z[t] = to.z - from.z;
      w.outside_t[t] = 1;
      w.outside_value[t] = end_value_of(t);
    });
    for (int k = steps - 1; k > 0;
         --k) {  // from the far end: the background sample seen last is the first on the way
      const float at = static_cast<float>(k) * stride;
      b.for_own(count, [&](int t) {
        const float value = sample_silhouette(c, words, w.at(t, at));
        w.outside_t[t] = value < 0 ? at : w.outside_t[t];
        w.outside_value[t] = value < 0 ? value : w.outside_value[t];
      });
    }
    b.for_own(count, [&](int t) {
      w.inside_t[t] = max(w.outside_t[t] - stride, 0.F);
      w.inside_value[t] = 0.5F;
    });
    for (int i = 0; i < kBisections; ++i) {
      b.for_own(count, [&](int t) {
        const float middle = 0.5F * (w.inside_t[t] + w.outside_t[t]);
        const float value = sample_silhouette(c, words, w.at(t, middle));
        const bool outside = value < 0;
        w.outside_t[t] = outside ? middle : w.outside_t[t];
        w.outside_value[t] = outside ? value : w.outside_value[t];
        w.inside_t[t] = outside ? w.inside_t[t] : middle;
        w.inside_value[t] = outside ? w.inside_value[t] : value;
      });
    }
    b.for_own(count, [&](int t) {
      const float share = w.inside_value[t] / (w.inside_value[t] - w.outside_value[t]);
      const float leave = fma(w.outside_t[t] - w.inside_t[t], share, w.inside_t[t]);
      report(edge_of(t), std::bit_cast<std::uint32_t>(leave));
    });
  }
};

}  // namespace tactus
