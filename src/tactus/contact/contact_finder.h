#pragma once
/// Contact of one point of a body: the search that makes its list of triangles, and the correction of the
/// point.
#include "tactus/contact/point_query.h"

namespace tactus {

/// Finds the colliders that points touch at the end of a substep, and how their positions and velocities are
/// to change. Works in the coordinates of each component of the surface at its capture: a point is taken back
/// by the component's motion, so triangles and cells stay as they were made however fast the surface moves.
struct ContactFinder {
  Boundaries boundaries;
  TouchingPoints body;
  float restitution, friction;
  float margin_m;  ///< triangles nearer than that are listed
  SubstepsTo now;
  float dt_s = 0;  ///< since the last correction
  Index pose = 0;
  TACTUS_HD void load() {
    now.load();
    turn_to(0);
  }
  /// To a point, and those that are corrected with it.
  TACTUS_HD void turn_to(Index point) {
    dt_s = now.since_s(point);
    pose = now.pose(point);
  }

  TACTUS_HD const SurfacePoses& poses() const { return boundaries.poses[pose]; }
  TACTUS_HD Index own(Index collider) const {
    return collider < kComponents ? poses().own(collider) : kAnyComponent;
  }
  /// The number of the tool that an collider is; -1: it is none.
  TACTUS_HD Index tool_of(Index collider) const {
    return collider < kComponents ? -1 : boundaries.obstacles[collider - kComponents].tool;
  }
  /// A component is known again by its label.
  TACTUS_HD Index label_of(Index collider) const {
    return collider < kComponents ? poses().component[collider].component.label : -1;
  }
  /// Collider that a point touched, by its number in this frame; -1: it is gone.
  TACTUS_HD Index collider_of(const PointContact& contact) const {
    const Index collider = contact.collider, count = poses().count;
    if (collider < 0 || collider >= kComponents || (collider < count && label_of(collider) == contact.label))
      return collider;
    TACTUS_ROLLED
    for (Index k = 0; k < count; ++k)
      if (label_of(k) == contact.label) return k;
    return -1;
  }
  TACTUS_HD Vec3f velocity_of(Index collider, Vec3f x) const {
    if (collider < kComponents) return poses().component[collider].velocity_at(x);
    const Index t = tool_of(collider);
    return t >= 0 ? poses().tool[t].velocity_at(x) : Vec3f{};
  }
  /// The other way round than to the collider's coordinates.
  TACTUS_HD Vec3f to_world(Index collider, Vec3f direction) const {
    if (collider < kComponents) return poses().component[collider].turn * direction;
    const Index t = tool_of(collider);
    return t >= 0 ? poses().tool[t].turn * direction : direction;
  }
  /// How point i meets an collider.
  TACTUS_HD MeetingPoint meet(Index i, Index collider, Vec3f x, Vec3f v) const {
    const Vec3f face = facing(i, collider), moved = way(i, collider, x, v);
    const Index t = tool_of(collider);
    if (collider >= kComponents && t < 0) return {x, x - moved, face};
    const Mat3f back = transpose(t >= 0 ? poses().tool[t].turn : poses().component[collider].turn);
    const Vec3f p = t >= 0 ? poses().tool[t].to_tool(x) : poses().component[collider].to_capture(x);
    return {p, p - back * moved, back * face};
  }
  /// How a point came to x as its collider sees it, since it was on the outside. That of a point which
  /// touches is where contact wanted it, a little above the surface, and not where it was: a point that
  /// shares its nodes, or that its body pulls, may have stayed inside. Its way would not tell then by which
  /// side it came in, and from beyond the middle of a thin plate it would be brought to the wrong one.
  TACTUS_HD Vec3f way(Index i, Index collider, Vec3f x, Vec3f v) const {
    const PointContact& contact = body.state.contact[i];
    if (body.state.touching[i] != 1 || collider_of(contact) != collider || tool_of(collider) >= 0)
      return dt_s * (v - velocity_of(collider, x));
    const Vec3f held = contact.x_m + dt_s * velocity_of(collider, contact.x_m);
    return (x - held) - kAbove * body.reach_m * contact.n;
  }
  /// Out of the wall of a cut that a point is on; 0: it is on none.
  TACTUS_HD Vec3f wall_out(Index i) const {
    Vec3f out{};
    if (body.table.sides.empty()) return out;
    const EmbeddedPoint& point = body.table.points[i];
    const WallSide& side = body.table.sides[i];
    TACTUS_ROLLED
    for (int k = 0; k < 8; ++k)
      if (side.weight[k] != 0.F) out += side.weight[k] * body.nodes.position(point.node[k]);
    return out;
  }
  /// The normal where the point touches this collider, as it was; 0: it doesn't. The wall of a cut is on the
  /// side of a blade that faces it: both walls may be where the blade is, and each goes to its own side.
  TACTUS_HD Vec3f facing(Index i, Index collider) const {
    if (tool_of(collider) >= 0) {
      if (const Vec3f out = wall_out(i); out != Vec3f{}) return -normalized(out);
    }
    const PointContact& contact = body.state.contact[i];
    const bool same =
        collider_of(contact) == collider || (contact.collider < kComponents && collider < kComponents);
    return body.state.touching[i] != 0 && same ? contact.n : Vec3f{};
  }
  /// Squared: how far a point moved at most relative to anything since the pose `then`, at which it was at
  /// from_m. For points that are means of others, no more than the most of those.
  TACTUS_HD float moved2_m2(Vec3f from_m, Index then, Vec3f x_m) const {
    float most = 0;
    for_each_collider(then, [&](auto&& seen_then, auto&& seen_now) {
      const Vec3f moved = seen_now(x_m) - seen_then(from_m);
      most = max(most, dot(moved, moved));
    });
    return most;
  }
  /// f(seen_then, seen_now) for all that may have moved since the pose `then`, or stood still: both take a
  /// point of the world to where it is as seen by an collider, at that pose and at this.
  template <class F>
  TACTUS_HD void for_each_collider(Index then, F&& f) const {
    const SurfacePoses &before = boundaries.poses[then], &all = poses();
    if (boundaries.obstacles.size() > all.tools) {  // not all move
      const auto there = [](Vec3f x) TACTUS_ALWAYS_INLINE { return x; };
      f(there, there);
    }
    TACTUS_ROLLED
    for (Index k = 0; k < all.count; ++k)
      f([component = before.component[k]](Vec3f x) TACTUS_ALWAYS_INLINE { return component.to_capture(x); },
        [component = all.component[k]](Vec3f x) TACTUS_ALWAYS_INLINE { return component.to_capture(x); });
    TACTUS_ROLLED
    for (Index t = 0; t < all.tools; ++t)
      f([tool = before.tool[t]](Vec3f x) TACTUS_ALWAYS_INLINE { return tool.to_tool(x); },
        [tool = all.tool[t]](Vec3f x) TACTUS_ALWAYS_INLINE { return tool.to_tool(x); });
  }

  /// Where point i is, and whether its list may do.
  TACTUS_HD void begin(Index i, PointQuery& p) const {
    const EmbeddedPoint& point = body.table.points[i];
    const Vec3f x = body.position(point);
    const Index searched = body.state.searched[i];
    const PointNeighbours near = body.state.neighbours[i];
    const float moved = searched < 0 ? 0.F : tactus::sqrt(moved2_m2(near.x_m, searched, x));
    // A list of nothing is that of a point which has too many triangles for one.
    const bool lost = searched < 0 || !(moved < near.free_m) || near.listed_m == 0.F;
    p.x_m = x;
    p.now = PointQuery::Now::nothing;
    p.sleep_m = 0.999F * (near.free_m - moved) / body.spread(point);
    if (body.state.touching[i] != 0) p.sleep_m = 0;
    if (!lost && near.listed_m < 0.F) return;
    p.sleep_m = 0;
    if (!body.moves(point)) {  // in this frame, nothing can be done to it
      p.sleep_m = 1e30F;
      return;
    }
    p.v_m_s = body.velocity(point);
    p.moved_m = moved;
    p.near = near;
    p.now = PointQuery::Now::listed;
    if (lost) {
      lose(p);
      if (p.to_search == 0U) keep(i, p);
    }
    if (p.now == PointQuery::Now::listed) body.state.neighbours[i].moved_m = p.moved_m;
  }
  /// Point i, which `begin` found awake.
  TACTUS_HD void resume(Index i, Vec3f x_m, Vec3f v_m_s, PointQuery& p) const {
    p.x_m = x_m;
    p.v_m_s = v_m_s;
    p.near = body.state.neighbours[i];
    p.moved_m = p.near.moved_m;
    p.crowded = 0;
    p.gap_collider = -1;
    p.now = PointQuery::Now::listed;
  }
  /// Chooses the colliders to search round a point whose list is of no use: all that aren't clearly far.
  TACTUS_HD void lose(PointQuery& p) const {
    lose_of(p, [&](Index collider) { return apart(collider, p); });
  }
  /// Likewise, by all lanes of a block. @param aparts (kColliders) in shared memory
  template <class Block>
  TACTUS_HD void lose(const Block& b, ColliderApart* aparts, PointQuery& p) const {
    if constexpr (Block::kIsLoop) {
      lose(p);
    } else {
      b.for_threads(colliders(), [&](int e) { aparts[collider_at(e)] = apart(collider_at(e), p); });
      b.on_one_thread([&] { lose_of(p, [&](Index collider) { return aparts[collider]; }); });
    }
  }
  /// Keeps the results of the search.
  TACTUS_HD void keep(Index i, PointQuery& p) const {
    p.now = p.near.listed_m < 0.F ? PointQuery::Now::nothing : PointQuery::Now::listed;
    p.sleep_m = p.near.listed_m < 0.F && body.state.touching[i] == 0
                    ? 0.999F * p.near.free_m / body.spread(body.table.points[i])
                    : 0.F;
    body.state.neighbours[i] = p.near;
    body.state.searched[i] = pose;
  }

  /// Searches round point i, which is lost, with all lanes of a block. @param lists whether triangles are to
  /// be listed
  template <class Block>
  TACTUS_HD void search(const Block& b, Index i, PointQuery& p, TriangleSearch& q, bool lists) const {
    TACTUS_ROLLED
    for (std::uint32_t left = p.to_search; left != 0U; left &= left - 1U) {
      const auto collider = static_cast<Index>(lowest_bit(left));
      b.on_one_thread([&] { begin_search(q, collider, p); });
      search_collider(b, i, collider, mesh_of(collider), p, q, lists);
    }
    b.on_one_thread([&] {
      if (p.crowded != 0U) {
        p.near.count = 0;
        p.near.listed_m = 0;
      }
      keep(i, p);
    });
  }
  /// Triangle e of the list of point i.
  TACTUS_HD void see(Index i, Index e, PointQuery& p) const {
    const auto near = NearTriangle::of(body.state.near[i * kNearTriangles + e]);
    const MeetingPoint& at = p.meeting[near.collider];
    const SurfaceTrianglesView& mesh = mesh_of(near.collider);
    p.list[e] = {near, SeenTriangle::of(mesh.corners[near.slot], at.p_m, at.before_m, at.facing,
                                        mesh.slack_m(body.reach_m))};
  }
  /// Finds the correction of a point, or that it is lost: its list is too short.
  TACTUS_HD void conclude(Index i, bool may_search, PointQuery& p) const {
    const Vec3f x = p.x_m, v = p.v_m_s;
    Deepest deepest;
    TACTUS_ROLLED
    for (std::uint32_t left = p.near.colliders; left != 0U; left &= left - 1U) {
      const auto collider = static_cast<Index>(lowest_bit(left));
      SurfaceGap g;
      if (!find_gap(i, collider, may_search, p, g)) {
        p.now = PointQuery::Now::lost;
        return;
      }
      if (!g.inside || (tool_of(collider) >= 0 && !touches_tool(i, collider, p, g))) continue;
      deepest.see(g.gap_m, to_world(collider, g.n), velocity_of(collider, x), collider,
                  tool_of(collider) >= 0 && !g.entered);
    }
    TACTUS_ROLLED
    for (Index k = 0; k < boundaries.obstacles.size(); ++k) {
      if (boundaries.obstacles[k].kind == ObstacleKind::mesh) continue;
      const SurfaceGap g =
          boundaries.obstacles[k].shape_gap(x, x - way(i, kComponents + k, x, v), facing(i, kComponents + k));
      if (g.inside) deepest.see(g.gap_m, g.n, {}, kComponents + k);
    }
    if (deepest.collider < 0) {
      p.now = PointQuery::Now::nothing;
      return;
    }
    p.now = PointQuery::Now::done;
    const Index touching = body.state.touching[i];
    touch(i, x, v, touching, deepest);
    body.set_touching(i, body.table.points[i], 1);
  }
  /// A point that touches nothing now, but did a moment ago, is still held.
  TACTUS_HD void invalidate(Index i) const {
    const Index touching = body.state.touching[i];
    if (touching == 0) return;
    PointContact& contact = body.state.contact[i];
    if (const Index collider = collider_of(contact); collider >= 0)
      contact.anchor_m += dt_s * velocity_of(collider, contact.anchor_m);
    body.set_touching(i, body.table.points[i], touching < kLingering ? touching + 1 : 0);
  }

 private:
  /// Speed at which the walls of a new cut, where the blade is, are parted. Waves in soft tissue have some
  /// m/s; at once, a millimetre would throw them apart.
  static constexpr float kParting_m_s = 0.05F;
  static constexpr float kAbove = 0.01F;  ///< in reaches: above rounding, below a triangle's slack
  /// A blade that moves with its edge ahead is a wedge of less than that slope.
  static constexpr float kSteepestWedge = 0.2F;
  /// The edge of a blade pushes nothing away: it is to cut it. Nor does a flank push a point that came in by
  /// the edge: beside a cut that is still to open, a lattice can't be parted. But the walls of a cut are
  /// parted.
  TACTUS_HD bool touches_tool(Index i, Index collider, const PointQuery& p, const SurfaceGap& g) const {
    const Obstacle& o = boundaries.obstacles[collider - kComponents];
    if (o.edge_m.empty()) return true;
    const ToolPose& tool = poses().tool[o.tool];
    const Vec3f at = tool.to_tool(p.x_m), off = o.to_edge(at - g.gap_m * g.n);
    if (dot(off, off) < sqr(o.edge_reach_m)) return false;
    if (wall_out(i) != Vec3f{} || (body.state.touching[i] != 0 && body.state.contact[i].collider == collider))
      return true;
    const Vec3f rel = p.v_m_s - tool.velocity_at(p.x_m);
    const float ahead = dot(rel, tool.turn * normalized(o.to_edge(at))), approach = dot(rel, tool.turn * g.n);
    return g.entered && approach <= kSteepestWedge * min(ahead, 0.F);
  }
  /// The triangles of that collider.
  TACTUS_HD const SurfaceTrianglesView& mesh_of(Index collider) const {
    return collider < kComponents ? boundaries.surface : boundaries.obstacles[collider - kComponents].mesh;
  }
  /// f(triangle) for those of an collider that may decide.
  template <class F>
  TACTUS_HD static void for_each_listed(Index collider, const PointQuery& p, F&& f) {
    TACTUS_ROLLED
    for (Index word = 0; word < kListWords; ++word) {
      TACTUS_ROLLED
      for (std::uint32_t left = p.deciding[word]; left != 0U; left &= left - 1U) {
        const ListedTriangle& t = p.list[kListBits * word + lowest_bit(left)];
        if (t.near.collider == collider) f(t);
      }
    }
  }

  /// How many there are, and each of them.
  TACTUS_HD Index colliders() const { return poses().count + boundaries.obstacles.size(); }
  TACTUS_HD Index collider_at(Index e) const {
    return e < poses().count ? e : kComponents + (e - poses().count);
  }
  TACTUS_HD ColliderApart apart(Index collider, const PointQuery& p) const {
    return collider < kComponents ? component_apart(collider, p.x_m) : obstacle_apart(collider, p);
  }
  TACTUS_HD ColliderApart component_apart(Index collider, Vec3f x) const {
    const SurfacePose& pose_now = poses().component[collider];
    if (pose_now.motion.source == MotionSource::too_fast) return {};
    const Vec3f there = pose_now.to_capture(x);
    const float out = pose_now.component.outside_m(there);
    // Samples bound the box of a component. A triangle's parts may stick out by less than 3 spacings.
    if (out > 3 * body.reach_m) return {out - 1.5F * body.reach_m};
    if (!boundaries.surface.may_be_near(there)) return {boundaries.surface.sure_reach_m()};
    return {.is_near = true};
  }
  TACTUS_HD ColliderApart obstacle_apart(Index collider, const PointQuery& p) const {
    const Obstacle& o = boundaries.obstacles[collider - kComponents];
    if (o.tool >= 0 && poses().tool[o.tool].is_there == 0) return {};
    if (o.kind != ObstacleKind::mesh) {
      const float out = o.distance_m(p.x_m);
      return out > max(margin_m, dt_s * length(p.v_m_s)) ? ColliderApart{out}
                                                         : ColliderApart{.is_shape = true};
    }
    const Vec3f there = o.tool >= 0 ? poses().tool[o.tool].to_tool(p.x_m) : p.x_m;
    if (o.tool >= 0 && o.outside_m(there) > body.reach_m) return {o.outside_m(there)};
    if (!o.mesh.may_be_near(there)) return {o.mesh.sure_reach_m()};
    return {.is_near = true};
  }
  /// @param apart_of(collider) how it keeps from the point
  template <class F>
  TACTUS_HD void lose_of(PointQuery& p, F&& apart_of) const {
    p.near = {p.x_m, 1e30F, -1, 0, 0, 0};
    p.moved_m = 0;
    p.to_search = p.crowded = 0;
    p.now = PointQuery::Now::lost;
    TACTUS_ROLLED
    for (Index e = 0; e < colliders(); ++e) {
      const Index collider = collider_at(e);
      const ColliderApart of = apart_of(collider);
      p.near.free_m = min(p.near.free_m, of.free_m);
      if (of.is_near) p.to_search |= 1U << collider;
      if (of.is_shape) p.near.listed_m = 1e30F;
    }
  }

  TACTUS_HD void begin_search(TriangleSearch& q, Index collider, const PointQuery& p) const {
    q.at = p.meeting[collider];
    q.displacement_m = min(length(q.at.p_m - q.at.before_m), body.reach_m);
    q.least = q.facing = {};
    q.candidates = 0;
    q.listed = static_cast<std::uint32_t>(p.near.count);
  }
  template <class Block>
  TACTUS_HD void search_collider(const Block& b, Index i, Index collider, const SurfaceTrianglesView& mesh,
                                 PointQuery& p, TriangleSearch& q, bool lists) const {
    const Index component = own(collider);
    constexpr int kLanes = TriangleSearch::lanes<Block>();
    const auto once = [&](auto&& f) { b.on_one_thread(f); };
    const auto together = [&](auto&& f) { TriangleSearch::for_lanes(b, f); };
    together([&](int lane) {
      for (int c = lane; c < TriangleSearch::kCells; c += kLanes) q.find_cell(mesh, c);
    });
    together([&](int lane) {
      q.see_middles(mesh, component, q.begin[q.kOwnCell] + lane, q.end[q.kOwnCell], kLanes);
    });
    q.choose_runs(b, mesh, q.listed_within_m(body.reach_m, margin_m));
    together([&](int lane) { q.see_runs(mesh, component, lane, kLanes); });
    q.choose_runs(b, mesh, q.listed_within_m(body.reach_m, margin_m));
    together([&](int lane) {
      q.for_each_within(
          mesh, component, q.seen_within_m(body.reach_m), lane, kLanes,
          [&](Index, float d2, Vec3f corner, Vec3f normal) { q.see(d2, corner, normal, body.reach_m); });
    });
    once([&] { weigh(q, collider, mesh.sure_reach_m(), lists, p); });
    together([&](int lane) {
      if (q.within_m < 0.F) return;
      q.for_each_within(mesh, component, q.within_m, lane, kLanes, [&](Index slot, float, Vec3f, Vec3f) {
        const auto at = static_cast<Index>(atomic_fetch_add(q.listed, 1));
        // In any order: the results of a list don't depend on it.
        if (at < kNearTriangles)
          body.state.near[i * kNearTriangles + at] = NearTriangle{collider, slot}.packed();
      });
    });
    once([&] {
      if (q.listed > static_cast<std::uint32_t>(kNearTriangles)) p.crowded |= 1U << collider;
      p.near.count = static_cast<Index>(min(q.listed, static_cast<std::uint32_t>(kNearTriangles)));
    });
    if constexpr (!Block::kIsLoop) {
      if ((p.crowded >> collider & 1U) == 0U) return;
      find_gap_together(b, q, mesh, component, body.reach_m, [&](const SurfaceGap& gap) {
        p.gap = gap;
        p.gap_collider = collider;
      });
    }
  }
  /// Whether the collider is near, so that its triangles are to be listed, or only how far it is.
  TACTUS_HD void weigh(TriangleSearch& q, Index collider, float sure, bool lists, PointQuery& p) const {
    PointNeighbours& near = p.near;
    q.within_m = -1;
    if (q.candidates == 0U) {
      near.free_m = min(near.free_m, sure);
      return;
    }
    if (!lists || q.candidates > static_cast<std::uint32_t>(TriangleSearch::kCandidates)) {
      near.colliders |= 1U << collider;
      p.crowded |= 1U << collider;
      return;
    }
    const TriangleSearch::Nearest nearest = q.nearest();
    if (nearest.side_m >= 0.F && nearest.distance_m > max(margin_m, q.displacement_m)) {
      near.free_m = min(near.free_m, min(nearest.distance_m, sure));
      return;
    }
    near.colliders |= 1U << collider;
    q.within_m = max(2 * margin_m, q.needed_m(nearest, body.reach_m) + margin_m);
    near.listed_m = near.listed_m < 0.F ? q.within_m : min(near.listed_m, q.within_m);
  }

  /// The gap between a point and an collider whose triangles are near. Returns false where the list is too
  /// short.
  TACTUS_HD bool find_gap(Index i, Index collider, bool may_search, const PointQuery& p,
                          SurfaceGap& gap) const {
    const SurfaceTrianglesView& mesh = mesh_of(collider);
    const MeetingPoint& at = p.meeting[collider];
    GapOfTriangles found(body.reach_m);
    bool crowded = (p.crowded >> collider & 1U) != 0U;
    if (crowded && p.gap_collider == collider) {
      gap = p.gap;
      return true;
    }
    if (!crowded) {
      found = gap_of_list(collider, mesh, at.p_m, p);
      const float way = min(length(at.p_m - at.before_m), body.reach_m),
                  needed = max(way, found.needed_m(dot(at.facing, at.facing) > 0.F));
      crowded = needed + p.moved_m > p.near.listed_m || !sees_same(i, collider, mesh, at.p_m, needed, p);
      if (crowded && may_search) return false;
      if (!crowded && !found.inside()) return true;
    }
    gap = crowded ? mesh.gap(own(collider), at.p_m, at.before_m, body.reach_m, at.facing)
                  : found.gap(mesh.corners[found.slot()], at.p_m);
    return true;
  }
  /// Triangles that are farther than sure are listed if they are in the cells round the point. These have to
  /// be the same, then.
  TACTUS_HD bool sees_same(Index i, Index collider, const SurfaceTrianglesView& mesh, Vec3f at_m,
                           float needed_m, const PointQuery& p) const {
    if (needed_m <= mesh.sure_reach_m()) return true;
    Vec3f then = p.near.x_m;
    const SurfacePoses& before = boundaries.poses[body.state.searched[i]];
    if (const Index t = tool_of(collider); t >= 0)
      then = before.tool[t].to_tool(then);
    else if (collider < kComponents)
      then = before.component[collider].to_capture(then);
    return mesh.cells.grid.cell(at_m) == mesh.cells.grid.cell(then);
  }
  TACTUS_HD GapOfTriangles gap_of_list(Index collider, const SurfaceTrianglesView& mesh, Vec3f at_m,
                                       const PointQuery& p) const {
    GapOfTriangles found(body.reach_m);
    for_each_listed(collider, p, [&](const ListedTriangle& t) { found.see(t.seen, t.near.slot); });
    for_each_listed(collider, p, [&](const ListedTriangle& t) { found.choose(t.seen, t.near.slot); });
    if (found.crossed < 0 && found.is_mixed()) {
      SideOfTied tied(found.nearest2_m2);
      for_each_listed(collider, p, [&](const ListedTriangle& t) {
        tied.weigh(t.seen, mesh.face[t.near.slot], mesh.corners[t.near.slot], at_m);
      });
      found.weighed = tied.sign();
    }
    return found;
  }

  /// The normal part of the position goes to the surface at any velocity. The tangential part goes back to
  /// where the point was held, at most by mu times how deep it goes in the mean: Coulomb's law for positions,
  /// without which resting points creep. Restitution is for points that arrive: those that touched already
  /// are carried.
  TACTUS_HD void touch(Index i, Vec3f x, Vec3f v, Index touching, const Deepest& deepest) const {
    const Vec3f n = deepest.n, rel = v - deepest.velocity_m_s;
    PointContact& contact = body.state.contact[i];
    const bool same = touching != 0 && collider_of(contact) == deepest.collider;
    const float deep = -deepest.gap_m, before = same ? max(contact.left_m - kParting_m_s * dt_s, 0.F) : deep,
                left = deepest.parts ? min(before, deep) : 0.F, depth = deep - left;
    FrictionMemory memory = same ? contact.friction : FrictionMemory::begin(depth);
    memory.press(depth);
    const Vec3f anchor = same ? contact.anchor_m + dt_s * deepest.velocity_m_s : x - dt_s * rel;
    const Vec3f away = x - anchor, slide = away - dot(away, n) * n;
    const float distance = length(slide), most = friction * memory.depth_m;
    const Vec3f push = depth * n - (distance > most ? most / distance : 1.F) * slide;
    const Vec3f velocity_correction =
        memory.velocity_correction_m_s(rel, n, touching == 1 ? 0.F : restitution, friction);
    contact = {x + push, push,   velocity_correction,       deep, deepest.collider, n, x + push,
               left,     memory, label_of(deepest.collider)};
  }
};

}  // namespace tactus
