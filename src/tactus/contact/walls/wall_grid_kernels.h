#pragma once
/// Which triangles of a body's surface are near particles: the others need not be posed. Particles mark the
/// cells that they are in, marks spread by a reach, and a triangle is near when its box meets a marked cell.
#include <bit>

#include "tactus/compute/atomic.h"
#include "tactus/contact/walls/body_wall_kernels.h"
#include "tactus/geom/arrays/index_lists.h"
#include "tactus/geom/search/neighbour_cells.h"

namespace tactus {

/// Cells of a box, a bit each. Points outside of the box count in the cells at its faces.
struct WallGrid {
  static constexpr Index kWordBits = 32, kRowWords = 2, kRow = kWordBits * kRowWords;  ///< cells along x
  Vec3f low_m;
  float inverse_cell_1_m = 1;
  Index rows = 1, layers = 1;  ///< along y and z
  Index spread = 1;            ///< cells that the reach may touch on each side

  /// @param reach_m of particles
  static WallGrid over(const Box3f& box_m, float reach_m) {
    const Vec3f edge = box_m.max - box_m.min;
    const float cell_m =
        max(max(edge.x, max(edge.y, edge.z)) / static_cast<float>(kRow), max(reach_m, 1e-9F));
    const auto cells = [&](float m) { return clamp(floor_to_int(m / cell_m) + 1, Index(1), kRow); };
    return {box_m.min, 1.F / cell_m, cells(edge.y), cells(edge.z),
            floor_to_int(1.001F * reach_m / cell_m) + 1};
  }
  Index words() const { return kRowWords * rows * layers; }
  TACTUS_HD Vec3i cell(Vec3f x_m) const {
    const Vec3f at = inverse_cell_1_m * (x_m - low_m);
    return {cell(at.x, kRow), cell(at.y, rows), cell(at.z, layers)};
  }
  /// A coordinate that is not finite is in the first one.
  TACTUS_HD static Index cell(float at, Index cells) {
    return at > 0.F ? static_cast<Index>(min(at, static_cast<float>(cells - 1))) : 0;
  }
  TACTUS_HD Index word(Index x, Index y, Index z) const { return (z * rows + y) * kRowWords + x / kWordBits; }
  /// Bits of cells first .. last of a row.
  TACTUS_HD static std::uint64_t row_bits(Index first, Index last) {
    return (~std::uint64_t{0} >> static_cast<unsigned>(kRow - 1 - (last - first)))
           << static_cast<unsigned>(first);
  }
  TACTUS_HD std::uint64_t row_of(View<const std::uint32_t> marks, Index y, Index z) const {
    const Index first = word(0, y, z);
    return std::uint64_t{marks[first]} | std::uint64_t{marks[first + 1]} << 32U;
  }
  TACTUS_HD void set_row(View<std::uint32_t> marks, Index y, Index z, std::uint64_t bits) const {
    marks[word(0, y, z)] = static_cast<std::uint32_t>(bits);
    marks[word(0, y, z) + 1] = static_cast<std::uint32_t>(bits >> 32U);
  }
  /// The marks of a row and of all cells that are so many cells or fewer from it.
  TACTUS_HD std::uint64_t spread_row(View<const std::uint32_t> marks, Index y, Index z, Index cells) const {
    std::uint64_t all = 0;
    for (Index b = max(z - cells, Index(0)); b <= min(z + cells, layers - 1); ++b)
      for (Index a = max(y - cells, Index(0)); a <= min(y + cells, rows - 1); ++a) all |= row_of(marks, a, b);
    std::uint64_t wide = all;
    for (Index k = 1; k <= cells; ++k)
      wide |= all << static_cast<unsigned>(k) | all >> static_cast<unsigned>(k);
    return wide;
  }
  TACTUS_HD bool meets(View<const std::uint32_t> marks, Vec3f low, Vec3f high) const {
    const Vec3i a = cell(low), b = cell(high);
    const std::uint64_t bits = row_bits(a.x, b.x);
    for (Index z = a.z; z <= b.z; ++z)
      for (Index y = a.y; y <= b.y; ++y)
        if ((row_of(marks, y, z) & bits) != 0) return true;
    return false;
  }
  /// Marks the cells that a box meets. Threads may mark at once.
  TACTUS_HD void mark(View<std::uint32_t> marks, Vec3f low, Vec3f high) const {
    const Vec3i a = cell(low), b = cell(high);
    const std::uint64_t bits = row_bits(a.x, b.x);
    for (Index z = a.z; z <= b.z; ++z) {
      for (Index y = a.y; y <= b.y; ++y) {
        mark(marks[word(0, y, z)], static_cast<std::uint32_t>(bits));
        mark(marks[word(0, y, z) + 1], static_cast<std::uint32_t>(bits >> 32U));
      }
    }
  }
  TACTUS_HD static void mark(std::uint32_t& word, std::uint32_t bits) {
    if ((atomic_load(word) & bits) != bits) atomic_or(word, bits);
  }
};

/// How many threads those kernels have that choose an active set anew (active_wall_kernels.h): none, or all
/// once a thread has asked for it.
struct WallRefresh {
  enum Of : Index { kVertices, kTriangles, kRows, kNodes, kCounts };
  View<std::uint32_t> counts;             ///< kCounts, zero when a step begins
  View<const Index> vertices, triangles;  ///< (1) how many there are
  Index rows = 0, nodes = 0;
  /// Threads that ask at once write the same.
  TACTUS_HD void ask() const {
    if (atomic_load(counts[kRows]) != 0) return;
    atomic_store(counts[kVertices], static_cast<std::uint32_t>(vertices[0]));
    atomic_store(counts[kTriangles], static_cast<std::uint32_t>(triangles[0]));
    atomic_store(counts[kNodes], static_cast<std::uint32_t>(nodes));
    atomic_store(counts[kRows], static_cast<std::uint32_t>(rows));
  }
};

/// Thread: particle.
struct MarkCells {
  WallGrid grid;
  View<const SearchParticle> particles;
  View<std::uint32_t> marks;
  TACTUS_HD void operator()(Index i) const {
    const Vec3i c = grid.cell(particles[i].x_m);
    const std::uint32_t bit = 1U << static_cast<unsigned>(c.x % WallGrid::kWordBits);
    WallGrid::mark(marks[grid.word(c.x, c.y, c.z)], bit);
  }
};

/// Counters of a step of the liquid on its way to the walls.
struct NearCounts {
  enum : Index {
    kListedTriangles,  ///< of the surface, near particles
    kListedPieces,     ///< of these triangles
    kLargestRadius,    ///< bits of the largest radius of these [m]
    kChosenParticles,  ///< that may be near a piece
    kSize
  };
};

/// Thread: row of cells. Each cell takes the marks of those round it.
struct SpreadMarks {
  WallGrid grid;
  View<const std::uint32_t> marks;
  View<std::uint32_t> near;
  View<std::uint32_t> counts;         ///< NearCounts, emptied
  View<const std::uint32_t> guarded;  ///< cells for which the active set is chosen anew; or empty
  WallRefresh refresh;
  TACTUS_HD void operator()(Index row) const {
    if (row == 0)
      for (Index k = 0; k < counts.size(); ++k) counts[k] = 0;
    const Index y = row % grid.rows, z = row / grid.rows;
    const std::uint64_t wide = grid.spread_row(marks, y, z, grid.spread);
    grid.set_row(near, y, z, wide);
    if (!guarded.empty() && (wide & grid.row_of(guarded, y, z)) != 0) refresh.ask();
  }
};

/// Thread: active triangle of the surface. Lists those that are near particles, in any order.
struct ListNearTriangles {
  static constexpr int kGrain = 512;
  WallGrid grid;
  View<const std::uint32_t> near;
  View<const Index> active;
  View<const Vec3i> surface;
  View<const PosedVertex> posed;
  View<Index> listed;
  View<std::uint32_t> counts;  ///< NearCounts
  TACTUS_HD void operator()(Index k) const {
    const Vec3i v = surface[active[k]];
    if (v.x < 0) return;
    const Vec3f a = posed[v.x].x_m, b = posed[v.y].x_m, c = posed[v.z].x_m;
    if (grid.meets(near, min(a, min(b, c)), max(a, max(b, c))))
      listed[static_cast<Index>(atomic_fetch_add(counts[NearCounts::kListedTriangles], 1U))] = active[k];
  }
};

/// Thread: triangle that is near. Poses the vertices that halving added there, and lists its pieces that are
/// near, in any order: the search sorts them by their numbers.
struct PoseNearTriangles {
  /// Two cores that list in turns take the lines of all lists from one another: five times as long as one.
  static constexpr int kGrain = 4096;
  WallGrid grid;
  View<const std::uint32_t> near;
  View<const Index> listed;
  View<const IndexRange> added_of, pieces_of;
  View<const Index> added_list, piece_list;
  View<const WallVertex> added;
  Index first;  ///< place of the first added vertex
  View<const Vec3i> triangles;
  View<PosedVertex> posed;
  View<std::uint32_t> counts;  ///< NearCounts
  // By place in the list:
  View<Index> number;
  View<Vec3i> corners;
  View<Vec3f> middle_m;
  View<float> radius_m;  ///< of a ball round it that holds the triangle
  View<Vec3f> normals;   ///< unit
  TACTUS_HD void operator()(Index k) const {
    const IndexRange own = added_of[listed[k]], pieces = pieces_of[listed[k]];
    for (Index i = own.begin; i < own.end; ++i) pose(added_list[i]);
    // Capacity for all that are near at once: threads that count one by one wait for one another.
    const bool is_whole = pieces.end - pieces.begin == 1;  // the triangle itself, which is near
    Index count = is_whole ? 1 : 0;
    for (Index i = pieces.begin; i < pieces.end && !is_whole; ++i)
      count += is_near(triangles[piece_list[i]]) ? 1 : 0;
    if (count == 0) return;
    auto place = static_cast<Index>(
        atomic_fetch_add(counts[NearCounts::kListedPieces], static_cast<std::uint32_t>(count)));
    for (Index i = pieces.begin; i < pieces.end; ++i)
      if (is_whole || is_near(triangles[piece_list[i]])) list(piece_list[i], place++);
  }

 private:
  TACTUS_HD void pose(Index i) const {
    const WallVertex v = added[i];
    const PosedVertex p = posed[v.corners.x], q = posed[v.corners.y], r = posed[v.corners.z];
    const float a = 1.F - v.b - v.c;
    posed[first + i] = {p.x_m + (v.b * (q.x_m - p.x_m) + v.c * (r.x_m - p.x_m)),
                        a * p.v_m_s + (v.b * q.v_m_s + v.c * r.v_m_s),
                        a * p.inverse_mass_1_kg + (v.b * q.inverse_mass_1_kg + v.c * r.inverse_mass_1_kg)};
  }
  TACTUS_HD bool is_near(Vec3i v) const {
    const Vec3f a = posed[v.x].x_m, b = posed[v.y].x_m, c = posed[v.z].x_m;
    return grid.meets(near, min(a, min(b, c)), max(a, max(b, c)));
  }
  TACTUS_HD void list(Index t, Index k) const {
    const Vec3i v = triangles[t];
    const Vec3f a = posed[v.x].x_m, b = posed[v.y].x_m, c = posed[v.z].x_m;
    const Vec3f middle = (1.F / 3) * ((a + b) + c);
    const float r2 =
        max(dot(a - middle, a - middle), max(dot(b - middle, b - middle), dot(c - middle, c - middle)));
    number[k] = t;
    corners[k] = v;
    middle_m[k] = middle;
    const float radius = 1.0001F * tactus::sqrt(r2);  // rounding
    radius_m[k] = radius;
    std::uint32_t& largest = counts[NearCounts::kLargestRadius];
    if (radius > std::bit_cast<float>(atomic_load(largest)))
      atomic_max(largest, std::bit_cast<std::uint32_t>(radius));
    normals[k] = normalized(cross(b - a, c - a));
  }
};

}  // namespace tactus
