#pragma once
/// Marching cubes over active bricks: one vertex per crossed grid edge (vertex_kernels.h says where), shared
/// by all its triangles. Everything is numbered in global order of bricks, rows and axes, so parts of a
/// device set agree by themselves.
#include "tactus/base/bits.h"
#include "tactus/geom/mesh/marching_cubes.h"
#include "tactus/reconstruct/hull_kernels.h"

namespace tactus {

/// Input of the mesh passes: signs and numbering of the active bricks.
struct BrickTable {
  BrickMap map;
  View<const Index> bricks;            ///< number of the brick in each slot
  View<const std::uint8_t> rows;       ///< kBrickRows per slot
  View<const CameraBits> sub_cameras;  ///< 8 per slot

  TACTUS_HD Vec3i brick_at(Index slot) const { return map.grid.brick_at(bricks[slot]); }
};

/// Vertices and triangles of a brick, or of all bricks before it, in one word.
struct MeshCount {
  std::uint64_t packed;
  TACTUS_HD static MeshCount of(Index vertices, Index triangles) {
    return {static_cast<std::uint64_t>(triangles) << 32 | static_cast<std::uint32_t>(vertices)};
  }
  TACTUS_HD Index vertices() const { return static_cast<Index>(packed & 0xFFFFFFFFU); }
  TACTUS_HD Index triangles() const { return static_cast<Index>(packed >> 32); }
};

/// Signs of the 9^3 nodes that the cells of a brick touch: bit x of row z*9+y.
struct PaddedSigns {
  static constexpr int kRows = 81;
  Index neighbour[8];  ///< slots of the bricks at (dx,dy,dz), bit by bit; negative: uniform
  std::uint32_t row[kRows];

  template <class Block>
  TACTUS_HD void load(const Block& b, const BrickTable& table) {
    const Vec3i brick = table.brick_at(b.index());
    b.for_threads(8, [&](int t) {
      neighbour[t] = table.map.slot_of(brick + Vec3i{t & 1, t >> 1 & 1, t >> 2});
    });
    b.for_range(kRows, [&](int r) {
      const int y = r % 9, z = r / 9, side = (y >> 3) * 2 + (z >> 3) * 4;
      const auto bits_of = [&](Index s) -> std::uint32_t {
        return s >= 0 ? table.rows[s * kBrickRows + (z & 7) * kBrick + (y & 7)]
                      : (s == kInsideBrick ? 0xFFU : 0U);
      };
      row[r] = bits_of(neighbour[side]) | (bits_of(neighbour[side + 1]) & 1U) << 8;
    });
  }
  TACTUS_HD std::uint32_t at(int y, int z) const { return row[z * 9 + y]; }
  /// Crossed edges owned by the nodes of a row: along x in byte 0, y in byte 1, z in byte 2.
  TACTUS_HD std::uint32_t crossings(int y, int z) const {
    const std::uint32_t r = at(y, z);
    return ((r ^ r >> 1) & 0xFFU) | ((r ^ at(y + 1, z)) & 0xFFU) << 8 | ((r ^ at(y, z + 1)) & 0xFFU) << 16;
  }
  /// Cells of a row with corners of both signs.
  TACTUS_HD std::uint32_t surface_cells(int y, int z) const {
    const std::uint32_t a = at(y, z), c = at(y + 1, z), d = at(y, z + 1), e = at(y + 1, z + 1);
    const std::uint32_t any = a | c | d | e, all = a & c & d & e;
    return (any | any >> 1) & ~(all & all >> 1) & 0xFFU;
  }
  /// Sign pattern of a cell, as marching cubes numbers it.
  TACTUS_HD std::uint32_t cell_signs(int x, int y, int z) const {
    return (at(y, z) >> x & 3U) | (at(y + 1, z) >> x & 3U) << 2 | (at(y, z + 1) >> x & 3U) << 4 |
           (at(y + 1, z + 1) >> x & 3U) << 6;
  }
};

/// Number of vertices, triangles and active bricks of one part, for the others and the report.
struct PartCounts {
  Index vertices = 0, triangles = 0;
  Index active_bricks = 0;  ///< of the own layers
  Index held_bricks = 0;    ///< with the ghosts: wanted slots
};
/// Where a part's mesh goes in the mesh of all parts.
struct PartPlace {
  Index vertices = 0, triangles = 0;           ///< of the parts before
  Index vertex_words = 0, triangle_words = 0;  ///< of this part
};

/// Counts vertices and triangles of each active brick, and numbers them within the brick, row by row.
struct CountBrickMesh {
  BrickTable table;
  View<const CellCase> cases;
  View<std::uint32_t> crossings;  ///< out: kBrickRows per slot
  View<std::uint32_t>
      row_start;  ///< out: kBrickRows per slot: first vertex | first triangle << 16, within the brick
  View<std::uint64_t> mesh_count;  ///< out, per slot: a MeshCount

  static constexpr int kThreads = 64;
  struct Shared {
    PaddedSigns signs;
    std::uint32_t count[64];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    s.signs.load(b, table);
    const Index first = b.index() * kBrickRows;
    b.for_each_thread([&](int t) {
      const int y = t & 7, z = t >> 3;
      const std::uint32_t crossed = s.signs.crossings(y, z);
      crossings[first + t] = crossed;
      std::uint32_t triangles = 0;
      for (std::uint32_t cells = s.signs.surface_cells(y, z); cells != 0; cells &= cells - 1) {
        triangles += cases[static_cast<Index>(s.signs.cell_signs(lowest_bit(cells), y, z))].triangle_count;
      }
      s.count[t] = static_cast<std::uint32_t>(popcount(crossed)) | triangles << 16;
    });
    b.for_each_thread([&](int t) {
      if (t != 0) return;
      std::uint32_t sum = 0;
      for (int r = 0; r < 64; ++r) {
        const std::uint32_t count = s.count[r];
        s.count[r] = sum;
        sum += count;
      }
      mesh_count[b.index()] =
          MeshCount::of(static_cast<Index>(sum & 0xFFFFU), static_cast<Index>(sum >> 16)).packed;
    });
    b.for_each_thread([&](int t) { row_start[first + t] = s.count[t]; });
  }
};

/// After an overflow there are triangles of vertices that do not exist: their readers must stay within the
/// vertices.
TACTUS_HD inline Vec3i existing(Vec3i triangle, Index max_vertices) {
  return max(triangle.x, max(triangle.y, triangle.z)) < max_vertices ? triangle : Vec3i{0, 0, 0};
}

/// Numbers of the vertices on the edges that a brick's cells touch.
struct PaddedNumbers {
  static constexpr int kRows = PaddedSigns::kRows;
  // First vertex numbers of the rows of PaddedSigns; behind those of the eighth node are those of the ninth,
  // which is another brick's first.
  Index first[2 * kRows];
  std::uint32_t crossed[2 * kRows];  ///< crossed edges, as PaddedSigns::crossings

  /// `signs` are loaded; all vertices are `shift` on.
  template <class Block>
  TACTUS_HD void load(const Block& b, const PaddedSigns& signs, View<const std::uint32_t> crossings,
                      View<const std::uint32_t> row_start, View<const std::uint64_t> mesh_start,
                      Index shift) {
    b.for_range(2 * kRows, [&](int i) {
      const int ninth = i >= kRows ? 1 : 0, r = i - ninth * kRows, y = r % 9, z = r / 9;
      const Index owner = signs.neighbour[ninth | (y >> 3) << 1 | (z >> 3) << 2];
      // Numbers of a uniform brick are not read, except after an overflow of slots, which the status reports.
      const Index slot = max(owner, 0), row = slot * kBrickRows + (z & 7) * kBrick + (y & 7);
      const Index number =
          MeshCount{mesh_start[slot]}.vertices() + static_cast<Index>(row_start[row] & 0xFFFFU);
      const std::uint32_t edges = crossings[row];
      first[i] = shift + (owner < 0 ? 0 : number);
      crossed[i] = owner < 0 ? 0U : edges;
    });
  }
  /// Number of the vertex on edge `e` of the cell at (x, y, z) of the brick.
  TACTUS_HD Index vertex(int x, int y, int z, int e) const {
    // Corners of all edges, three bits each: without a branch.
    constexpr std::uint64_t kCorners = [] {
      std::uint64_t corners = 0;
      for (int edge = 0; edge < kCellEdges; ++edge)
        corners |= static_cast<std::uint64_t>(edge_corner(edge)) << 3 * edge;
      return corners;
    }();
    const int corner = static_cast<int>(kCorners >> 3 * e), axis = e >> 2;
    x += corner & 1;
    y += corner >> 1 & 1;
    z += corner >> 2 & 1;
    const int i = (x >> 3) * kRows + z * 9 + y;
    const std::uint32_t before = (1U << (8 * axis + (x & 7))) - 1U;
    return first[i] + popcount(crossed[i] & before);
  }
};

/// Triangles of a brick, as numbers of vertices in the order of all parts.
struct EmitTriangles {
  BrickTable table;
  View<const CellCase> cases;
  View<const std::uint32_t> crossings, row_start;
  View<const std::uint64_t> mesh_start;  ///< scanned MeshCounts, per slot
  View<const PartPlace> place;           ///< of this part's vertices; empty when it is the only one
  Index max_vertices;                    ///< there is no vertex of this number or more
  View<const PartPlace> out_place;       ///< of this part in `triangles`; empty: at its beginning
  /// Out, maybe in another device's memory: three vertices, counter-clockwise from outside.
  View<Vec3i> triangles;

  static constexpr int kThreads = 128;
  struct Shared {
    PaddedSigns signs;
    PaddedNumbers numbers;
    std::uint16_t
        code[3 * kMaxCellTriangles * kBrickRows * kBrick];  ///< of corners: edge << 9 | row << 3 | x
    Index vertex[3 * kThreads];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    s.signs.load(b, table);
    s.numbers.load(b, s.signs, crossings, row_start, mesh_start, place.empty() ? 0 : place[0].vertices);
    list_corners(b, s);
    const Index before = MeshCount{mesh_start[b.index()]}.triangles(),
                behind = MeshCount{mesh_start[b.index() + 1]}.triangles();
    const Index begin = (out_place.empty() ? 0 : out_place[0].triangles) + before;
    const Index total = min(behind - before, triangles.size() - begin);
    for (Index first = 0; first < total; first += kThreads) {
      const int corners = 3 * min(total - first, Index{kThreads});
      b.for_range(corners, [&](int i) {
        const int code = s.code[3 * first + i];
        s.vertex[i] = s.numbers.vertex(code & 7, code >> 3 & 7, code >> 6 & 7, code >> 9);
      });
      b.for_threads(corners / 3, [&](int t) {
        Index* v = s.vertex + 3 * t;
        if (max(v[0], max(v[1], v[2])) >= max_vertices) v[0] = v[1] = v[2] = 0;
      });
      // Word by word: whole lines are written, and may cross a link.
      static_assert(sizeof(Vec3i) == 3 * sizeof(Index));
      auto* to = reinterpret_cast<Index*>(triangles.data() + begin + first);
      b.for_range(corners, [&](int i) { to[i] = s.vertex[i]; });
    }
  }

 private:
  template <class Block>
  TACTUS_HD void list_corners(const Block& b, Shared& s) const {
    b.for_threads(kBrickRows, [&](int t) {
      const int y = t & 7, z = t >> 3;
      Index at = 3 * static_cast<Index>(row_start[b.index() * kBrickRows + t] >> 16);
      for (std::uint32_t cells = s.signs.surface_cells(y, z); cells != 0; cells &= cells - 1) {
        const int x = lowest_bit(cells);
        const CellCase& cell = cases[static_cast<Index>(s.signs.cell_signs(x, y, z))];
        for (int k = 0; k < 3 * cell.triangle_count; ++k)
          s.code[at++] = static_cast<std::uint16_t>(cell.edge[k] << 9 | t << 3 | x);
      }
    });
  }
};

}  // namespace tactus
