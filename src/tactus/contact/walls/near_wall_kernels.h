#pragma once
/// Walls beside particles: the real surface and obstacles, as planes.
#include "tactus/contact/response_kernels.h"
#include "tactus/geom/search/near_walls.h"
#include "tactus/geom/search/neighbour_cells.h"

namespace tactus {

/// Signed distance to the nearest of a surface's triangles, on either side.
struct NearestOnSurface {
  float distance_m = 0;
  Vec3f n;
  bool found = false;

  /// The side is that of GapOfTriangles. @param reach_m no triangle farther than that is found
  TACTUS_HD static NearestOnSurface of(const SurfaceTrianglesView& mesh, Index own, Vec3f p_m,
                                       float reach_m) {
    GapOfTriangles gap(reach_m);
    float within = reach_m;
    const auto seen_by = [&](auto&& use) {
      for_each_ball_within(mesh, own, p_m, reach_m, within,
                           [&](Index s) { use(SeenTriangle::of(mesh.corners[s], p_m, p_m, {}, 0.F), s); });
    };
    seen_by([&](const SeenTriangle& t, Index s) {
      gap.see(t, s);
      within = (1.F + GapOfTriangles::kTie) * tactus::sqrt(gap.nearest2_m2);
    });
    seen_by([&](const SeenTriangle& t, Index s) { gap.choose(t, s); });
    if (gap.nearest < 0) return {};
    if (gap.is_mixed()) {
      SideOfTied tied(gap.nearest2_m2);
      seen_by([&](const SeenTriangle& t, Index s) { tied.weigh(t, mesh.face[s], mesh.corners[s], p_m); });
      gap.weighed = tied.sign();
    }
    const TriangleCorners& t = mesh.corners[gap.nearest];
    const Vec3f offset = t.offset_of(p_m), face = normalized(cross(t.b - t.a, t.c - t.a));
    const float side = gap.inside() ? -1.F : 1.F, distance = length(offset);
    return {side * distance, distance > 1e-7F ? (side / distance) * offset : face, true};
  }
  /// The surface across from the nearest point that was found: WallAcross.
  TACTUS_HD NearestOnSurface across(const SurfaceTrianglesView& mesh, Index own, Vec3f p_m,
                                    float reach_m) const {
    NearestOnSurface other;
    float within = reach_m;
    for_each_ball_within(mesh, own, p_m, reach_m, within, [&](Index s) {
      const TriangleCorners& t = mesh.corners[s];
      const Vec3f face = normalized(cross(t.b - t.a, t.c - t.a));
      if (!WallAcross::may_face(n, face)) return;
      const Vec3f offset = t.offset_of(p_m);
      const float distance = length(offset);
      // Among triangles that are equally near, the first counts: all devices visit them in one order.
      if (distance > within || (other.found && distance == within) ||
          !WallAcross::faces(n, face, offset, distance))
        return;
      within = distance;
      other = {distance, distance > 1e-7F ? (1.F / distance) * offset : face, true};
    });
    return other;
  }

 private:
  /// f(slot) for the triangles whose balls come within a distance that f may shorten.
  template <class F>
  TACTUS_HD static void for_each_ball_within(const SurfaceTrianglesView& mesh, Index own, Vec3f p_m,
                                             float reach_m, const float& within_m, F&& f) {
    for_each_slot_within(mesh.cells, p_m, reach_m, [&](Index s) {
      const TriangleBall ball = mesh.balls[s];
      const Vec3f to = p_m - ball.middle_m;
      if (dot(to, to) <= sqr(within_m + ball.radius_m) && mesh.is_of(own, s)) f(s);
    });
  }
  /// f(slot) for the slots of all cells that may hold the middle of a triangle within reach_m.
  template <class F>
  TACTUS_HD static void for_each_slot_within(const CellRanges& cells, Vec3f p_m, float reach_m, F&& f) {
    if (!cells.grid.holds(p_m)) return;
    const float r = reach_m + SurfaceTrianglesView::kLargestBall / cells.grid.inverse_cell_1_m;
    const Vec3i low = cells.grid.cell(p_m - Vec3f{r, r, r}), high = cells.grid.cell(p_m + Vec3f{r, r, r});
    for (Index z = low.z; z <= high.z; ++z) {
      for (Index y = low.y; y <= high.y; ++y) {
        for (Index x = low.x; x <= high.x; ++x) {
          const Index w = cells.grid.wrapped({x, y, z});
          for (Index s = cells.begin[w], end = cells.end[w]; s < end; ++s) f(s);
        }
      }
    }
  }
};

/// Adds the components of the real surface, obstacles and tools to the walls near every particle. A plane or
/// box is exact; of a mesh or a component, the nearest point counts.
struct FindNearWalls {
  static constexpr int kGrain = 256;
  View<const SearchParticle> particles;
  Boundaries boundaries;
  SubstepsTo now;  ///< the poses after so many substeps count
  float reach_m;
  Index first_collider;  ///< walls are first_collider + collider
  NearWalls near;
  Index pose = 0;
  TACTUS_HD void load() {
    now.load();
    pose = now.pose(0);
  }
  TACTUS_HD void operator()(Index i) const {
    const Vec3f x = particles[i].x_m;
    const SurfacePoses& all = boundaries.poses[pose];
    for (Index k = 0; k < all.count; ++k) {
      const SurfacePose& component = all.component[k];
      const Vec3f p = component.to_capture(x);
      const float reach = reach_to(boundaries.surface);
      // Samples bound the box of a component; a particle deep inside of one is in the box.
      if (!component.may_touch(p, reach + 3 * spacing_m(boundaries.surface)) ||
          !may_be_near(boundaries.surface, p, reach))
        continue;
      add_surface(i, boundaries.surface, all.own(k), p, reach, component.turn, component.velocity_at(x),
                  first_collider + k);
    }
    for (Index k = 0; k < boundaries.obstacles.size(); ++k) {
      const Obstacle& o = boundaries.obstacles[k];
      const Index collider = first_collider + kComponents + k;
      if (o.tool >= 0)
        add_tool(i, o, all.tool[o.tool], collider);
      else if (o.kind == ObstacleKind::mesh)
        add_mesh(i, o.mesh, x, Mat3f::identity(), {}, collider);  // placed in the world already
      else
        add_shape(i, o, x, collider);
    }
  }

 private:
  TACTUS_HD void add_tool(Index i, const Obstacle& o, const ToolPose& tool, Index collider) const {
    const Vec3f x = particles[i].x_m, p = tool.to_tool(x);
    if (tool.is_there == 0 || o.outside_m(p) > reach_m) return;
    add_mesh(i, o.mesh, p, tool.turn, tool.velocity_at(x), collider);
  }
  TACTUS_HD static float spacing_m(const SurfaceTrianglesView& mesh) {
    return 0.5F / mesh.cells.grid.inverse_cell_1_m;
  }
  /// The table of near cells of a fine mesh covers less than the reach; half of the reach matters.
  TACTUS_HD float reach_to(const SurfaceTrianglesView& mesh) const {
    return min(reach_m, max(mesh.sure_reach_m(), 0.5F * reach_m));
  }
  TACTUS_HD static bool may_be_near(const SurfaceTrianglesView& mesh, Vec3f p, float reach) {
    return reach > mesh.sure_reach_m() || mesh.may_be_near(p);
  }
  TACTUS_HD void add_mesh(Index i, const SurfaceTrianglesView& mesh, Vec3f p, const Mat3f& turn,
                          Vec3f velocity_m_s, Index collider) const {
    const float reach = reach_to(mesh);
    if (may_be_near(mesh, p, reach))
      add_surface(i, mesh, kAnyComponent, p, reach, turn, velocity_m_s, collider);
  }
  /// @param p_m in the coordinates of the surface, from which `turn` leads to the world's
  TACTUS_HD void add_surface(Index i, const SurfaceTrianglesView& mesh, Index own, Vec3f p_m, float reach,
                             const Mat3f& turn, Vec3f velocity_m_s, Index collider) const {
    const NearestOnSurface on = NearestOnSurface::of(mesh, own, p_m, reach);
    if (!on.found) return;
    near.add(i, {turn * on.n, on.distance_m, velocity_m_s, collider, 0.F, {}});
    const NearestOnSurface other = on.across(mesh, own, p_m, reach);
    if (other.found) near.add(i, {turn * other.n, other.distance_m, velocity_m_s, collider, 0.F, {}, 1});
  }
  /// Adds a plane, or the face of a box that the particle is farthest in front of and those that end it near
  /// the particle.
  TACTUS_HD void add_shape(Index i, const Obstacle& o, Vec3f x, Index collider) const {
    const Mat3f back = transpose(o.T_obstacle_world.R);
    const Vec3f p = o.T_obstacle_world * x;
    if (o.kind == ObstacleKind::plane) {
      if (p.y < reach_m) near.add(i, {back.column(1), p.y, {}, collider, 0.F, {}});
      return;
    }
    const Vec3f out = Vec3f{abs(p.x), abs(p.y), abs(p.z)} - o.half_m;
    const int first = out.x >= out.y && out.x >= out.z ? 0 : (out.y >= out.z ? 1 : 2);
    if (!(out[first] < reach_m)) return;
    for (int k = 0; k < 3; ++k) {
      const int a = (first + k) % 3;
      if (!(out[a] > -reach_m)) continue;
      const Vec3f n = p[a] < 0.F ? -back.column(a) : back.column(a);
      near.add(i, {n, out[a], {}, collider, 0.F, {}, k == 0 ? 0 : NearWall::kBeside});
    }
  }
};

}  // namespace tactus
