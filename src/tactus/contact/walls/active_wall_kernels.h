#pragma once
/// The active set of a body's surface: the triangles that may soon come near the liquid, and their vertices.
/// A step poses and lists these alone, so its cost follows the part of the surface near the liquid, however
/// large the body.
///
/// When the set is chosen, a triangle is active if its box meets a cell that is at most kMargin cells from
/// those that are near the liquid. A cell is guarded if it is at most one cell from the box of any other
/// triangle: while no vertex has moved by more than a cell, these come to no other cells. So the set is
/// complete as long as nodes have moved less than that, and no cell near the liquid is guarded. Each step
/// tests both, and chooses the set anew where it may be incomplete: fast motion costs time, but no triangle
/// is missed.
#include "tactus/contact/walls/wall_grid_kernels.h"

namespace tactus {

/// Thread: node. Asks for another set where it has moved too far since the last was chosen.
struct WatchNodes {
  static constexpr int kGrain = 1024;
  ContactNodes nodes;
  View<const Vec3f> chosen_m;  ///< where nodes were then
  View<const float> most_m;    ///< (1) along any axis: no vertex has left the cells beside its own
  WallRefresh refresh;
  TACTUS_HD void operator()(Index node) const {
    const Vec3f moved = nodes.position(node) - chosen_m[node];
    if (max(abs(moved.x), max(abs(moved.y), abs(moved.z))) > most_m[0]) refresh.ask();
  }
};

/// Thread: row of cells. Empties the set.
struct StartActive {
  WallGrid grid;
  Index margin;  ///< cells
  View<const std::uint32_t> near;
  View<std::uint32_t> wide;   ///< near, and the margin
  View<std::uint32_t> taken;  ///< by triangles that are not active
  View<std::uint32_t> counts;
  TACTUS_HD void operator()(Index row) const {
    if (row == 0)
      for (Index k = 0; k < counts.size(); ++k) counts[k] = 0;
    const Index y = row % grid.rows, z = row / grid.rows;
    grid.set_row(wide, y, z, grid.spread_row(near, y, z, margin));
    grid.set_row(taken, y, z, 0);
  }
};

/// Thread: vertex.
struct PoseInactiveVertices {
  static constexpr int kGrain = 512;
  PoseWallVertices pose;
  View<std::uint32_t> is_active;
  TACTUS_HD void operator()(Index i) const {
    pose(i);
    is_active[i] = 0;
  }
};

/// Thread: triangle of the surface. It and its vertices become active, in any order, or it takes its cells.
struct ChooseActive {
  static constexpr int kGrain = 512;
  WallGrid grid;
  View<const std::uint32_t> wide;
  View<const Vec3i> surface;
  View<const PosedVertex> posed;
  View<std::uint32_t> taken;
  View<std::uint32_t> is_active;  ///< per vertex
  View<std::uint32_t> counts;     ///< of triangles and vertices
  View<Index> triangles, vertices;
  TACTUS_HD void operator()(Index t) const {
    const Vec3i v = surface[t];
    if (v.x < 0) return;
    const Vec3f a = posed[v.x].x_m, b = posed[v.y].x_m, c = posed[v.z].x_m;
    const Vec3f low = min(a, min(b, c)), high = max(a, max(b, c));
    if (!grid.meets(wide, low, high)) return grid.mark(taken, low, high);
    triangles[static_cast<Index>(atomic_fetch_add(counts[0], 1U))] = t;
    for (int k = 0; k < 3; ++k) {
      std::uint32_t& seen = is_active[v[k]];
      if (atomic_load(seen) == 0 && atomic_exchange(seen, 1U) == 0)
        vertices[static_cast<Index>(atomic_fetch_add(counts[1], 1U))] = v[k];
    }
  }
};

/// Thread: row of cells.
struct GuardCells {
  WallGrid grid;
  View<const std::uint32_t> taken;
  View<std::uint32_t> guarded;
  TACTUS_HD void operator()(Index row) const {
    const Index y = row % grid.rows, z = row / grid.rows;
    grid.set_row(guarded, y, z, grid.spread_row(taken, y, z, 1));
  }
};

/// Thread: node. Where it is when the set is chosen.
struct NoteNodes {
  static constexpr int kGrain = 1024;
  ContactNodes nodes;
  View<Vec3f> chosen_m;
  TACTUS_HD void operator()(Index node) const { chosen_m[node] = nodes.position(node); }
};

}  // namespace tactus
