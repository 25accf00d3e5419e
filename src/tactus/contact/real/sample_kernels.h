#pragma once
/// From triangles to samples of a surface, and from samples to fewer, evenly spread ones.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"
#include "tactus/contact/real/vertex_forest.h"
#include "tactus/geom/search/cell_list_kernels.h"

namespace tactus {

inline constexpr Index kNoComponent = -1;   ///< of samples that borrow the first component's motion
inline constexpr Index kAnyComponent = -2;  ///< asks for samples of any component

/// Cells of samples are sought in a table of 32^3, so a row of them along x is one word.
inline constexpr int kCellBits = 5;
inline constexpr Index kRowCells = 1 << kCellBits, kCellRows = kRowCells * kRowCells;

/// Whether any of the 27 cells round p holds samples.
TACTUS_HD inline bool near_any_cell(const CellGrid& grid, View<const std::uint32_t> near_rows, Vec3f p_m) {
  if (!grid.holds(p_m)) return false;
  const Vec3i c = grid.cell(p_m);
  constexpr Index kMask = kRowCells - 1;
  const std::uint32_t row = near_rows[(c.y & kMask) | (c.z & kMask) << kCellBits];
  return (row >> (c.x & kMask) & 1U) != 0;
}

/// Samples of a closed surface, sorted by cells.
struct SamplesView {
  View<const Vec3f> x_m;        ///< position [m]
  View<const Vec3f> n;          ///< unit normal, outward
  View<const float> area_m2;    ///< area that the sample stands for [m²]
  View<const Index> component;  ///< which separate component of the surface it is on (component_kernels.h)
  CellRanges cells;             ///< runs of samples by cell
  View<const std::uint32_t> near_rows;  ///< (kCellRows) see NearRows
  View<const Index> count;              ///< (1) number of samples
  /// f(i) for all samples in the 27 cells around p; most points are near none, and that costs one look.
  template <class F>
  TACTUS_HD void for_each_near(Vec3f p_m, F&& f) const {
    if (may_be_near(p_m)) cells.for_each_slot(p_m, f);
  }
  TACTUS_HD bool may_be_near(Vec3f p_m) const { return near_any_cell(cells.grid, near_rows, p_m); }
  /// Whether sample i moves with that component.
  TACTUS_HD bool is_of(Index wanted, Index i) const {
    return wanted == kAnyComponent || max(component[i], Index(0)) == wanted;
  }
};

inline constexpr Index kMaxCuts = 32;  ///< a triangle's edge is cut into fewer components than that

/// How many components of at most edge_m the longest edge of a triangle is cut into, squared; 0 for triangles
/// without area, with non-finite corners or with indices that are no vertices.
struct TriangleCuts {
  View<const Vec3f> vertices_m;
  Count vertex_count;
  View<const Vec3i> triangles;
  float edge_m;
  float most;        ///< components along an edge
  View<Index> cuts;  ///< out
  TACTUS_HD void operator()(Index t) const {
    cuts[t] = 0;
    const Vec3i v = triangles[t];
    const Index n = vertex_count.get();
    if (v.x < 0 || v.y < 0 || v.z < 0 || v.x >= n || v.y >= n || v.z >= n) return;
    const Vec3f a = vertices_m[v.x], ab = vertices_m[v.y] - a, ac = vertices_m[v.z] - a;
    const float twice_area = length(cross(ab, ac));
    if (!(twice_area > 0.F && twice_area < 1e12F)) return;
    const Vec3f bc = ac - ab;
    const float longest = tactus::sqrt(max(dot(ab, ab), max(dot(ac, ac), dot(bc, bc))));
    const float k = min(longest / edge_m, most);
    const Index whole = floor_to_int(k);
    const Index components = max(Index(1), static_cast<float>(whole) < k ? whole + 1 : whole);
    cuts[t] = components * components;
  }
};

/// A sample in the middle of each of the k² equal components of a triangle (two neighbouring triangles never
/// make the same one, so edges need no collider).
struct TriangleSamples {
  View<const Vec3f> vertices_m;
  View<const Vec3f> normals;  ///< per vertex, or empty: the triangle's
  View<const Vec3i> triangles;
  View<const Index> cuts, first;
  VertexForest forest;
  View<Vec3f> x_m, n;
  View<float> area_m2;
  View<Index> root;  ///< of the component that the triangle is on
  View<Index> triangle;
  TACTUS_HD void operator()(Index t) const {
    if (cuts[t] == 0) return;
    const Vec3i v = triangles[t];
    const auto of = static_cast<Index>(forest.find(static_cast<std::uint32_t>(v.x)));
    const Vec3f a = vertices_m[v.x], ab = vertices_m[v.y] - a, ac = vertices_m[v.z] - a;
    const Vec3f twice_area = cross(ab, ac);
    const float twice = length(twice_area);
    const Vec3f face = (1.F / twice) * twice_area;
    const float area = 0.5F * twice / static_cast<float>(cuts[t]);
    Index k = 1;
    while (k * k < cuts[t]) ++k;
    Index s = first[t];
    for (Index row = 0; row < k; ++row) {
      for (Index col = 0; col < 2 * (k - row) - 1; ++col, ++s) {
        if (s >= x_m.size()) return;
        const float middle = (col & 1) != 0 ? 2.F / 3.F : 1.F / 3.F;
        const float u = (static_cast<float>(row) + middle) / static_cast<float>(k);
        const float w = (static_cast<float>(col / 2) + middle) / static_cast<float>(k);
        x_m[s] = a + u * ab + w * ac;
        n[s] = normals.empty() ? face : normal_at(v, u, w, face);
        area_m2[s] = area;
        root[s] = of;
        triangle[s] = t;
      }
    }
  }

 private:
  TACTUS_HD Vec3f normal_at(Vec3i v, float u, float w, Vec3f face) const {
    const Vec3f m = (1.F - u - w) * normals[v.x] + u * normals[v.y] + w * normals[v.z];
    return dot(m, face) > 0.F ? m : face;  // also for NaN, and where the source's normals point inward
  }
};

/// Samples that are merged into one: same small cell, same one of the six main directions (so the two sides
/// of something thin stay apart). 20 bits an axis, 3 bits of direction.
struct SampleLabels {
  static constexpr std::uint64_t kNone = ~std::uint64_t(0);
  CellGrid grid;
  float subcells;  ///< per cell and axis
  View<const Index> order;
  View<const std::uint32_t> keys;
  View<const Vec3f> x_m, n;
  View<std::uint64_t> labels;  ///< by slot
  TACTUS_HD void operator()(Index slot) const {
    if (static_cast<Index>(keys[slot]) >= grid.cell_count()) {
      labels[slot] = kNone;
      return;
    }
    const Index i = order[slot];
    // Within its cell, not on a finer grid of its own: rounding must not put it under another cell's slots.
    const Vec3f p = grid.inverse_cell_1_m * x_m[i];
    const Vec3i c = grid.cell(x_m[i]);
    labels[slot] = (axis(c.x, p.x) << 43) | (axis(c.y, p.y) << 23) | (axis(c.z, p.z) << 3) | direction(n[i]);
  }

 private:
  TACTUS_HD std::uint64_t axis(Index cell, float p) const {
    const auto per_cell = static_cast<Index>(subcells);
    const Index sub = clamp(floor_to_int((p - static_cast<float>(cell)) * subcells), Index(0), per_cell - 1);
    return static_cast<std::uint64_t>(cell * per_cell + sub) & 0xfffffU;
  }
  TACTUS_HD static std::uint64_t direction(Vec3f v) {
    const float x = tactus::abs(v.x), y = tactus::abs(v.y), z = tactus::abs(v.z);
    if (x >= y && x >= z) return v.x < 0 ? 1 : 0;
    if (y >= z) return v.y < 0 ? 3 : 2;
    return v.z < 0 ? 5 : 4;
  }
};

inline constexpr Index kLabelsAhead = 8;  ///< that a GPU fetches while it waits for one

/// 1 for the first slot of every label.
struct SampleReferenceNodes {
  CellRanges cells;
  View<const std::uint32_t> keys;
  View<const std::uint64_t> labels;
  View<Index> flags;
  TACTUS_HD void operator()(Index slot) const {
    const std::uint64_t mine = labels[slot];
    Index first = mine != SampleLabels::kNone ? 1 : 0;
    if (first != 0) {
      // Backwards: samples of one label mostly follow one another.
      const Index begin = cells.begin[static_cast<Index>(keys[slot])];
      for (Index s = slot - 1; s >= begin && first != 0; s -= kLabelsAhead) {
        for (Index u = 0; u < kLabelsAhead; ++u) first &= labels[max(s - u, begin)] == mine ? 0 : 1;
      }
    }
    flags[slot] = first;
  }
};

/// out = min(count, capacity); overflow = samples that didn't fit.
struct LimitCount {
  View<const Index> count;
  Index capacity;
  View<Index> out, overflow;
  TACTUS_HD void operator()(Index) const {
    out[0] = min(count[0], capacity);
    overflow[0] = max(Index(0), count[0] - capacity);
  }
};

/// The same for the sum of the first `items` counts, `first` being the sums of those before each.
struct LimitSum {
  View<const Index> counts, first;
  Count items;
  Index capacity;
  View<Index> out, overflow;
  TACTUS_HD void operator()(Index) const {
    const Index last = items.get() - 1, sum = last < 0 ? 0 : first[last] + counts[last];
    out[0] = min(sum, capacity);
    overflow[0] = max(Index(0), sum - capacity);
  }
};

/// Bit x of row y + 32 z: whether any of the 27 cells around that cell has samples. Block z: the rows of z.
struct NearRows {
  static constexpr int kThreads = 3 * kRowCells;
  View<const Index> end;  ///< of each cell: 0 where there is none
  View<std::uint32_t> rows;
  struct Shared {
    std::uint32_t occupied[kThreads];  ///< rows of layers z - 1, z, z + 1
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    b.for_each_thread([&](int t) {
      const Index z = (b.index() + t / kRowCells - 1) & (kRowCells - 1),
                  first = (z * kRowCells + t % kRowCells) * kRowCells;
      std::uint32_t word = 0;
      for (Index x = 0; x < kRowCells; ++x) word |= (end[first + x] > 0 ? 1U : 0U) << x;
      s.occupied[t] = word;
    });
    b.for_threads(kRowCells, [&](int y) {
      std::uint32_t word = 0;
      for (Index layer = 0; layer < kThreads; layer += kRowCells) {
        for (Index dy = -1; dy <= 1; ++dy) word |= s.occupied[layer + ((y + dy) & (kRowCells - 1))];
      }
      rows[b.index() * kRowCells + y] = word | word << 1 | word >> 31 | word >> 1 | word << 31;
    });
  }
};

/// One sample for all of a label: area-weighted middle and normal. Block o: reference_node o. Its threads
/// share the slots of the reference_node's cell, and add up their sums in pairs.
struct MergeSamples {
  static constexpr int kThreads = 32;
  View<const Index> reference_nodes;
  CellRanges cells;
  View<const Index> order;
  View<const std::uint32_t> keys;
  View<const std::uint64_t> labels;
  View<const Vec3f> x_m, n;
  View<const float> area_m2;
  View<const Index> component;
  View<Vec3f> x_out_m, n_out;
  View<float> area_out_m2;
  View<Index> component_out;  ///< the reference_node's
  View<std::uint32_t> keys_out;
  struct Sum {
    Vec3f x_m3, normal_m2;
    float area_m2 = 0;
  };
  struct Shared {
    Sum of[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    b.for_each_thread([&](int t) { s.of[t] = sum(reference_nodes[b.index()], t); });
    for (int half = kThreads / 2; half > 0; half /= 2) {
      b.for_threads(half, [&](int t) {
        s.of[t].x_m3 += s.of[t + half].x_m3;
        s.of[t].normal_m2 += s.of[t + half].normal_m2;
        s.of[t].area_m2 += s.of[t + half].area_m2;
      });
    }
    b.on_one_thread([&] { write(b.index(), s.of[0]); });
  }

 private:
  /// Over every 32nd slot.
  TACTUS_HD Sum sum(Index reference_node, Index t) const {
    const std::uint64_t label = labels[reference_node];
    const Vec3f origin = x_m[order[reference_node]];
    Sum sum;
    for (Index slot = reference_node + t, last = cells.end[static_cast<Index>(keys[reference_node])];
         slot < last; slot += kThreads) {
      if (labels[slot] != label) continue;
      const Index i = order[slot];
      sum.area_m2 += area_m2[i];
      sum.x_m3 += area_m2[i] * (x_m[i] - origin);
      sum.normal_m2 += area_m2[i] * n[i];
    }
    return sum;
  }
  TACTUS_HD void write(Index o, const Sum& sum) const {
    const Index reference_node = reference_nodes[o], i = order[reference_node];
    x_out_m[o] = x_m[i] + sum.x_m3 / sum.area_m2;
    n_out[o] = normalized(sum.normal_m2, n[i]);
    area_out_m2[o] = sum.area_m2;
    component_out[o] = component[i];
    keys_out[o] = keys[reference_node];
  }
};

}  // namespace tactus
