#pragma once
/// Finds what the points of a body touch.
///
/// A point that is far from everything sleeps until it has moved, relative to each boundary, by what it is
/// away from it. A point that is near one keeps a list of its triangles, which holds until the point has
/// moved by more than the list's margin. Both are exact: a list is used only where no triangle outside of it
/// can matter, so what is found is what a search through all triangles would find.
#include "tactus/contact/response_kernels.h"
#include "tactus/contact/triangle_search.h"

namespace tactus {

/// A triangle in a point's list: whose it is, and its slot there.
struct NearTriangle {
  static constexpr int kSlotBits = 26;
  static_assert(kOwners <= 1 << (32 - kSlotBits));
  Index owner, slot;
  TACTUS_HD std::uint32_t packed() const {
    return static_cast<std::uint32_t>(owner) << kSlotBits | static_cast<std::uint32_t>(slot);
  }
  TACTUS_HD static NearTriangle of(std::uint32_t packed) {
    return {static_cast<Index>(packed >> kSlotBits), static_cast<Index>(packed & ((1U << kSlotBits) - 1U))};
  }
};

/// The deepest of what a point is in.
struct Deepest {
  float gap_m = 0;
  Vec3f n, velocity_m_s;
  Index owner = -1;
  TACTUS_HD void see(float gap, Vec3f normal, Vec3f velocity, Index who) {
    if (!(gap < gap_m)) return;
    gap_m = gap;
    n = normal;
    velocity_m_s = velocity;
    owner = who;
  }
};

/// Block: points that take part together. Finds what each touches at the end of a substep, and how its
/// position and velocity are to change. Works in the coordinates of each piece of the surface at its capture:
/// a point is taken back by the piece's motion, so triangles and cells stay as they were made however fast
/// the surface moves.
struct FindContacts {
  static constexpr int kThreads = 256, kPoints = kBlockPoints, kLanes = kThreads / kPoints, kLeastBlocks = 2,
                       kGrain = 32;
  static constexpr int kSearches = kThreads / TriangleSearch::kLanes;
  Boundaries boundaries;
  TouchingPoints body;
  PointBlocks blocks;
  Index first_block = 0;
  float restitution, friction;
  float margin_m;  ///< what is nearer than that is listed
  SubstepsTo now;
  float dt_s = 0;  ///< since the last correction
  Index pose = 0;
  TACTUS_HD void load() {
    now.load();
    dt_s = now.dt_s * static_cast<float>(now.steps);
    pose = now.substep + now.steps - 1;
  }

  enum class Now : Index { nothing, lost, listed, done };
  struct Shared {
    Now now[kPoints];
    Vec3f x_m[kPoints], v_m_s[kPoints];
    float moved_m[kPoints];  ///< since the search
    float sleep_m[kPoints];  ///< so far it may move without touching anything
    PointNeighbours near[kPoints];
    std::uint32_t to_search[kPoints], crowded[kPoints];  ///< owners, as bits
    std::uint32_t searched_owners, crowded_owners;
    int awake[kPoints], awake_count, lost[kPoints], lost_count;
    float distance2_m2[kPoints][kNearTriangles], side_m[kPoints][kNearTriangles],
        share[kPoints][kNearTriangles];
    Index faces[kPoints][kNearTriangles];
    TriangleSearch search[kSearches];
    SurfaceGap gap[kPoints];  ///< to what has too many triangles for a list, where all lanes looked for it
    Index gap_owner[kPoints];
    float node_moved2_m2[kThreads];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    if (body.nodes.has_stopped()) return;
    const Index block = first_block + b.index(), first = blocks.points[block].begin,
                count = blocks.points[block].end - first;
    if (count == 0) return;  // room
    b.on_one_thread([&] { s.searched_owners = s.crowded_owners = 0; });
    // On a GPU, all points are looked at in the time of one.
    float moved_m = kNever;
    if constexpr (Block::kIsLoop) {
      moved_m = block_moved_m(b, s, block);
      if (!wake(s, first, count, moved_m)) return;
      for (int k = 0; k < s.awake_count; ++k) look(first + s.awake[k], s.awake[k], s);
    } else {
      b.for_threads(count, [&](int t) { look(first + t, t, s); });
    }
    // Again where a list was too short, and where a new one is, too: a GPU's lanes look for the gap together.
    constexpr int kRounds = Block::kIsLoop ? 2 : 3;
    for (int round = 0; round < kRounds; ++round) {
      b.compact(
          count, [&](int t) { return s.now[t] == Now::lost; }, s.lost, &s.lost_count);
      if (round > 0 && s.lost_count == 0) break;
      for (int k = 0; k < s.lost_count; k += kSearches) search(b, s, first, k, round < 2);
      const auto is_listed = [&](int t) { return s.now[t] == Now::listed; };
      b.template for_groups<kLanes>(count, is_listed, [&](int t, int lane) {
        for (Index e = lane; e < s.near[t].count; e += kLanes) see(first + t, t, e, s);
      });
      b.for_threads(count, [&](int t) {
        if (is_listed(t)) conclude(first + t, t, round + 1 < kRounds, s);
      });
    }
    b.for_threads(count, [&](int t) {
      if (s.now[t] == Now::nothing) let_go(first + t);
    });
    if constexpr (Block::kIsLoop) fall_asleep(b, s, block, moved_m);
  }

 private:
  TACTUS_HD const SurfacePoses& poses() const { return boundaries.poses[pose]; }
  /// f(triangles of that owner). Not a reference to one or the other, which would have to lie in memory.
  template <class F>
  TACTUS_HD void with_mesh(Index owner, F&& f) const {
    if (owner < kPieces)
      f(boundaries.surface);
    else
      f(boundaries.obstacles[owner - kPieces].mesh);
  }
  TACTUS_HD Index own(Index owner) const { return owner < kPieces ? poses().own(owner) : kAnyPiece; }
  TACTUS_HD Vec3f velocity_of(Index owner, Vec3f x) const {
    return owner < kPieces ? poses().piece[owner].velocity_at(x) : Vec3f{};
  }
  TACTUS_HD MeetingPoint meet(Index owner, Vec3f x, Vec3f v, Vec3f facing) const {
    if (owner >= kPieces) return {x, x - dt_s * v, facing};
    const SurfacePose& surface = poses().piece[owner];
    const Mat3f back = transpose(surface.turn);
    const Vec3f p = surface.to_capture(x);
    return {p, p - dt_s * (back * (v - surface.velocity_at(x))), back * facing};
  }
  TACTUS_HD Vec3f facing(Index i) const {
    return body.state.touching[i] != 0 ? body.state.contact[i].n : Vec3f{};
  }
  /// Squared: how far a point moved at most relative to anything since the pose `then`, at which it was at
  /// from_m. For points that are means of others, no more than the most of those.
  TACTUS_HD float moved2_m2(Vec3f from_m, Index then, Vec3f x_m) const {
    const SurfacePoses &before = boundaries.poses[then], &all = poses();
    Vec3f moved = x_m - from_m;
    float most = boundaries.obstacles.empty() ? 0.F : dot(moved, moved);
    for (Index k = 0; k < all.count; ++k) {
      moved = all.piece[k].to_capture(x_m) - before.piece[k].to_capture(from_m);
      most = max(most, dot(moved, moved));
    }
    return most;
  }

  /// Where point t is, and whether its list may do.
  TACTUS_HD void look(Index i, int t, Shared& s) const {
    const EmbeddedPoint& point = body.table.points[i];
    const Vec3f x = body.position(point);
    const Index searched = body.state.searched[i];
    const PointNeighbours near = body.state.neighbours[i];
    const float moved = searched < 0 ? 0.F : tactus::sqrt(moved2_m2(near.x_m, searched, x));
    const bool lost = searched < 0 || !(moved < near.free_m);
    s.x_m[t] = x;
    s.now[t] = Now::nothing;
    s.sleep_m[t] = 0.999F * (near.free_m - moved) / body.spread(point);
    if (body.state.touching[i] != 0) s.sleep_m[t] = 0;
    if (!lost && near.listed_m < 0.F) return;
    s.sleep_m[t] = 0;
    if (!body.moves(point)) {  // in this frame, nothing can be done to it
      s.sleep_m[t] = 1e30F;
      return;
    }
    s.v_m_s[t] = body.velocity(point);
    s.moved_m[t] = moved;
    s.near[t] = near;
    s.crowded[t] = 0;
    s.gap_owner[t] = -1;
    s.now[t] = Now::listed;
    if (!lost) return;
    lose(t, s);
    if (s.to_search[t] == 0U) keep(i, t, s);
  }
  /// What is to be searched round a point whose list is of no use: all that isn't clearly far.
  TACTUS_HD void lose(int t, Shared& s) const {
    const Vec3f x = s.x_m[t], v = s.v_m_s[t];
    const SurfacePoses& all = poses();
    PointNeighbours near{x, 1e30F, -1, 0, 0};
    std::uint32_t to_search = 0;
    for (Index k = 0; k < all.count; ++k) {
      if (all.piece[k].motion.source == MotionSource::too_fast) continue;
      const Vec3f p = all.piece[k].to_capture(x);
      const float sure = boundaries.surface.sure_reach_m(), out = all.piece[k].piece.outside_m(p);
      // Samples bound the box of a piece. A triangle's parts may stick out by less than 3 spacings.
      if (out > 3 * body.reach_m)
        near.free_m = min(near.free_m, out - 1.5F * body.reach_m);
      else if (!boundaries.surface.may_be_near(p))
        near.free_m = min(near.free_m, sure);
      else
        to_search |= 1U << k;
    }
    for (Index k = 0; k < boundaries.obstacles.size(); ++k) {
      const Obstacle& o = boundaries.obstacles[k];
      if (o.kind == ObstacleKind::mesh) {
        if (o.mesh.may_be_near(x))
          to_search |= 1U << (kPieces + k);
        else
          near.free_m = min(near.free_m, o.mesh.sure_reach_m());
      } else if (const float out = o.distance_m(x); out > max(margin_m, dt_s * length(v))) {
        near.free_m = min(near.free_m, out);
      } else {
        near.listed_m = 1e30F;  // a shape without triangles is always looked at
      }
    }
    s.near[t] = near;
    s.moved_m[t] = 0;
    s.to_search[t] = to_search;
    s.crowded[t] = 0;
    s.now[t] = Now::lost;
    if (to_search != 0U) atomic_or(s.searched_owners, to_search);
  }
  /// Keeps what was found.
  TACTUS_HD void keep(Index i, int t, Shared& s) const {
    PointNeighbours& near = s.near[t];
    s.now[t] = near.listed_m < 0.F ? Now::nothing : Now::listed;
    s.sleep_m[t] = near.listed_m < 0.F && body.state.touching[i] == 0
                       ? 0.999F * near.free_m / body.spread(body.table.points[i])
                       : 0.F;
    body.state.neighbours[i] = near;
    body.state.searched[i] = pose;
  }

  /// Searches round the points of `lost` from `first_lost` on, a group of lanes each.
  template <class Block>
  TACTUS_HD void search(const Block& b, Shared& s, Index first, int first_lost, bool lists) const {
    const int n = min(kSearches, s.lost_count - first_lost);
    for (Index owner = 0; owner < kOwners; ++owner) {
      const std::uint32_t bit = 1U << owner;
      if ((s.searched_owners & bit) == 0U) continue;
      const auto is_wanted = [&](int g) { return (s.to_search[s.lost[first_lost + g]] & bit) != 0U; };
      b.for_threads(n, [&](int g) {
        if (is_wanted(g)) begin_search(s.search[g], owner, first, s.lost[first_lost + g], s);
      });
      with_mesh(owner, [&](const SurfaceTrianglesView& mesh) {
        search_owner(b, s, owner, n, is_wanted, first, mesh, lists);
      });
    }
    b.for_threads(n, [&](int g) {
      const int t = s.lost[first_lost + g];
      if (s.crowded[t] != 0U) s.near[t].count = 0, s.near[t].listed_m = 0;
      keep(first + t, t, s);
    });
  }
  TACTUS_HD void begin_search(TriangleSearch& q, Index owner, Index first, int t, const Shared& s) const {
    q.point = t;
    q.at = meet(owner, s.x_m[t], s.v_m_s[t], facing(first + t));
    q.way_m = min(length(q.at.p_m - q.at.before_m), body.reach_m);
    q.least = q.held = {};
    q.candidates = 0;
    q.listed = static_cast<std::uint32_t>(s.near[t].count);
  }
  template <class Block, class S>
  TACTUS_HD void search_owner(const Block& b, Shared& s, Index owner, int n, const S& is_wanted, Index first,
                              const SurfaceTrianglesView& mesh, bool lists) const {
    constexpr int kEach = Block::kIsLoop ? 1 : TriangleSearch::kLanes;
    const Index piece = own(owner);
    const auto for_each = [&](auto&& f) {
      b.template for_groups<kEach>(n, is_wanted, [&](int g, int lane) { f(s.search[g], lane); });
    };
    const auto once = [&](auto&& f) {
      b.for_threads(n, [&](int g) {
        if (is_wanted(g)) f(s.search[g]);
      });
    };
    for_each([&](TriangleSearch& q, int lane) {
      for (int c = lane; c < TriangleSearch::kCells; c += kEach) q.find_cell(mesh, c);
    });
    for_each([&](TriangleSearch& q, int lane) {
      q.see_middles(mesh, piece, q.begin[q.kOwnCell] + lane, q.end[q.kOwnCell], kEach);
    });
    once([&](TriangleSearch& q) { q.choose_runs(mesh, body.reach_m, margin_m); });
    for_each([&](TriangleSearch& q, int lane) { q.see_runs(mesh, piece, lane, kEach); });
    once([&](TriangleSearch& q) { q.choose_runs(mesh, body.reach_m, margin_m); });
    for_each([&](TriangleSearch& q, int lane) {
      q.for_each_within(
          mesh, piece, q.seen_within_m(body.reach_m), lane, kEach,
          [&](Index, float d2, Vec3f corner, Vec3f normal) { q.see(d2, corner, normal, body.reach_m); });
    });
    once([&](TriangleSearch& q) { weigh(q, owner, mesh.sure_reach_m(), lists, s); });
    for_each([&](TriangleSearch& q, int lane) {
      if (q.within_m < 0.F) return;
      q.for_each_within(mesh, piece, q.within_m, lane, kEach, [&](Index slot, float, Vec3f, Vec3f) {
        const auto at = static_cast<Index>(atomic_fetch_add(q.listed, 1));
        // In any order: what is found of a list doesn't depend on it.
        if (at < kNearTriangles)
          body.state.near[(first + q.point) * kNearTriangles + at] = NearTriangle{owner, slot}.packed();
      });
    });
    once([&](TriangleSearch& q) {
      if (q.listed > static_cast<std::uint32_t>(kNearTriangles)) crowd(q, owner, s);
      s.near[q.point].count = static_cast<Index>(min(q.listed, static_cast<std::uint32_t>(kNearTriangles)));
    });
    if constexpr (!Block::kIsLoop) {
      if ((s.crowded_owners >> owner & 1U) == 0U) return;
      const auto is_crowded = [&](int g) {
        return is_wanted(g) && (s.crowded[s.search[g].point] >> owner & 1U) != 0U;
      };
      find_gaps(b, s.search, n, is_crowded, mesh, piece, body.reach_m, [&](Index t, const SurfaceGap& gap) {
        s.gap[t] = gap;
        s.gap_owner[t] = owner;
      });
    }
  }
  TACTUS_HD static void crowd(const TriangleSearch& q, Index owner, Shared& s) {
    s.crowded[q.point] |= 1U << owner;
    atomic_or(s.crowded_owners, 1U << owner);
  }
  /// Whether the owner is near, so that its triangles are to be listed, or only how far it is.
  TACTUS_HD void weigh(TriangleSearch& q, Index owner, float sure, bool lists, Shared& s) const {
    PointNeighbours& near = s.near[q.point];
    q.within_m = -1;
    if (q.candidates == 0U) {
      near.free_m = min(near.free_m, sure);
      return;
    }
    if (!lists || q.candidates > static_cast<std::uint32_t>(TriangleSearch::kCandidates)) {
      near.owners |= 1U << owner;
      crowd(q, owner, s);
      return;
    }
    const TriangleSearch::Nearest nearest = q.nearest();
    if (nearest.side_m >= 0.F && nearest.distance_m > max(margin_m, q.way_m)) {
      near.free_m = min(near.free_m, min(nearest.distance_m, sure));
      return;
    }
    near.owners |= 1U << owner;
    q.within_m = max(2 * margin_m, q.needed_m(body.reach_m) + margin_m);
    near.listed_m = near.listed_m < 0.F ? q.within_m : min(near.listed_m, q.within_m);
  }

  /// Triangle e of a point's list.
  TACTUS_HD void see(Index i, int t, Index e, Shared& s) const {
    const NearTriangle near = NearTriangle::of(body.state.near[i * kNearTriangles + e]);
    const MeetingPoint at = meet(near.owner, s.x_m[t], s.v_m_s[t], facing(i));
    SeenTriangle seen;
    with_mesh(near.owner, [&](const SurfaceTrianglesView& mesh) {
      seen = SeenTriangle::of(mesh.corners[near.slot], at.p_m, at.before_m, at.facing,
                              mesh.slack_m(body.reach_m));
    });
    s.distance2_m2[t][e] = seen.distance2_m2;
    s.side_m[t][e] = seen.side_m;
    s.share[t][e] = seen.share;
    s.faces[t][e] = seen.faces;
  }
  /// The gap between a point and an owner whose triangles are near. Returns false where the list is too
  /// short.
  TACTUS_HD bool find_gap(Index i, int t, Index owner, bool may_search, const Shared& s,
                          SurfaceGap& gap) const {
    const Vec3f face = facing(i);
    const MeetingPoint at = meet(owner, s.x_m[t], s.v_m_s[t], face);
    GapOfTriangles found(body.reach_m);
    bool crowded = (s.crowded[t] >> owner & 1U) != 0U;
    if (crowded && s.gap_owner[t] == owner) {
      gap = s.gap[t];
      return true;
    }
    if (!crowded) {
      found = listed(i, t, owner, at.p_m, s);
      const float way = min(length(at.p_m - at.before_m), body.reach_m),
                  needed = max(way, found.needed_m(dot(face, face) > 0.F));
      crowded = needed + s.moved_m[t] > s.near[t].listed_m || !sees_same(i, t, owner, at.p_m, needed, s);
      if (crowded && may_search) return false;
      if (!crowded && !found.inside()) return true;
    }
    with_mesh(owner, [&](const SurfaceTrianglesView& mesh) {
      gap = crowded ? mesh.gap(own(owner), at.p_m, at.before_m, body.reach_m, at.facing)
                    : found.gap(mesh.corners[found.slot()], at.p_m);
    });
    return true;
  }
  /// Triangles that are farther than sure are listed if they are in the cells round the point. These have to
  /// be the same, then.
  TACTUS_HD bool sees_same(Index i, int t, Index owner, Vec3f p, float needed_m, const Shared& s) const {
    Vec3f then = s.near[t].x_m;
    if (owner < kPieces) then = boundaries.poses[body.state.searched[i]].piece[owner].to_capture(then);
    bool same = false;
    with_mesh(owner, [&](const SurfaceTrianglesView& mesh) {
      const CellGrid& grid = mesh.cells.grid;
      same = needed_m <= mesh.sure_reach_m() || grid.cell(p) == grid.cell(then);
    });
    return same;
  }
  /// What is to be done to a point, or that its list is too short.
  TACTUS_HD void conclude(Index i, int t, bool may_search, Shared& s) const {
    const Vec3f x = s.x_m[t], v = s.v_m_s[t];
    Deepest deepest;
    for (Index owner = 0; owner < kOwners; ++owner) {
      if ((s.near[t].owners >> owner & 1U) == 0U) continue;
      SurfaceGap g;
      if (!find_gap(i, t, owner, may_search, s, g)) return lose(t, s);
      if (!g.inside) continue;
      const Vec3f n = owner < kPieces ? poses().piece[owner].turn * g.n : g.n;
      deepest.see(g.gap_m, n, velocity_of(owner, x), owner);
    }
    for (Index k = 0; k < boundaries.obstacles.size(); ++k) {
      if (boundaries.obstacles[k].kind == ObstacleKind::mesh) continue;
      const SurfaceGap g = boundaries.obstacles[k].shape_gap(x, x - dt_s * v, facing(i));
      if (g.inside) deepest.see(g.gap_m, g.n, {}, kPieces + k);
    }
    if (deepest.owner < 0) {
      s.now[t] = Now::nothing;
      return;
    }
    s.now[t] = Now::done;
    const Index touching = body.state.touching[i];
    touch(i, x, v, touching, deepest);
    body.set_touching(i, body.table.points[i], 1);
  }
  TACTUS_HD GapOfTriangles listed(Index i, int t, Index owner, Vec3f p, const Shared& s) const {
    GapOfTriangles found(body.reach_m);
    for (int pass = 0; pass < 2; ++pass) {
      for (Index e = 0; e < s.near[t].count; ++e) {
        const NearTriangle near = NearTriangle::of(body.state.near[i * kNearTriangles + e]);
        if (near.owner != owner) continue;
        const SeenTriangle seen{s.distance2_m2[t][e], s.side_m[t][e], s.share[t][e], s.faces[t][e]};
        if (pass == 0)
          found.see(seen, near.slot);
        else
          found.choose(seen, near.slot);
      }
    }
    if (found.crossed < 0 && found.is_mixed()) found.weighed = weigh(i, t, owner, p, found.nearest2_m2, s);
    return found;
  }
  TACTUS_HD Index weigh(Index i, int t, Index owner, Vec3f p, float nearest2_m2, const Shared& s) const {
    SideOfTied tied(nearest2_m2);
    for (Index e = 0; e < s.near[t].count; ++e) {
      const NearTriangle near = NearTriangle::of(body.state.near[i * kNearTriangles + e]);
      if (near.owner != owner) continue;
      const SeenTriangle seen{s.distance2_m2[t][e], s.side_m[t][e], s.share[t][e], s.faces[t][e]};
      with_mesh(owner, [&](const SurfaceTrianglesView& mesh) {
        tied.weigh(seen, mesh.face[near.slot], mesh.corners[near.slot], p);
      });
    }
    return tied.sign();
  }

  /// The normal part of the position goes to the surface whatever the velocity. The tangential part goes back
  /// to where the point was held, at most by mu times how deep it went: Coulomb's law for positions, without
  /// which what rests creeps. Restitution is for what arrives: what touched already is carried.
  TACTUS_HD void touch(Index i, Vec3f x, Vec3f v, Index touching, const Deepest& deepest) const {
    const Vec3f n = deepest.n, rel = v - deepest.velocity_m_s;
    const float depth = -deepest.gap_m;
    PointContact& contact = body.state.contact[i];
    const bool same = touching != 0 && contact.owner == deepest.owner;
    const Vec3f held = same ? contact.held_m + dt_s * deepest.velocity_m_s : x - dt_s * rel;
    const Vec3f away = x - held, slide = away - dot(away, n) * n;
    const float distance = length(slide), most = friction * depth;
    const Vec3f push = depth * n - (distance > most ? most / distance : 1.F) * slide;
    const Vec3f kick = touch_kick(rel, n, touching == 1 ? 0.F : restitution, friction);
    contact = {x + push, push, kick, depth, deepest.owner, n, x + push};
  }
  /// What touches nothing now, but did a moment ago, is still held.
  TACTUS_HD void let_go(Index i) const {
    const Index touching = body.state.touching[i];
    if (touching == 0) return;
    PointContact& contact = body.state.contact[i];
    if (contact.owner < poses().count)
      contact.held_m += dt_s * poses().piece[contact.owner].velocity_at(contact.held_m);
    body.set_touching(i, body.table.points[i], touching < kLingering ? touching + 1 : 0);
  }

  /// How far a node of the block moved, at most, since the block was looked at; kNever: in this frame, it
  /// never was.
  template <class Block>
  TACTUS_HD float block_moved_m(const Block& b, Shared& s, Index block) const {
    const Index then = blocks.pose[block];
    if (then < 0) return kNever;
    const Index first = blocks.lists[block].begin, count = blocks.lists[block].end - first;
    b.for_threads(count, [&](int k) {
      s.node_moved2_m2[k] =
          moved2_m2(blocks.x_m[first + k], then, body.nodes.position(blocks.nodes[first + k]));
    });
    float most = 0;
    for (Index k = 0; k < count; ++k) most = max(most, s.node_moved2_m2[k]);
    return tactus::sqrt(most);
  }
  /// Lists the points that may touch something. Returns whether there is any.
  TACTUS_HD bool wake(Shared& s, Index first, Index count, float moved_m) const {
    s.awake_count = 0;
    for (Index t = 0; t < count; ++t) {
      s.now[t] = Now::nothing;
      s.awake[s.awake_count] = t;
      s.awake_count += moved_m != kNever && moved_m < blocks.sleep_m[first + t] ? 0 : 1;
    }
    return s.awake_count > 0;
  }
  /// Notes how far nodes may move, counted from where they are now if a point found new room.
  template <class Block>
  TACTUS_HD void fall_asleep(const Block& b, const Shared& s, Index block, float moved_m) const {
    const Index first = blocks.points[block].begin, count = blocks.points[block].end - first;
    bool has_room = false;
    for (int k = 0; k < s.awake_count; ++k) has_room = has_room || s.sleep_m[s.awake[k]] > 0.F;
    for (Index t = 0; t < count && has_room; ++t) blocks.sleep_m[first + t] -= moved_m;
    for (int k = 0; k < s.awake_count; ++k) blocks.sleep_m[first + s.awake[k]] = s.sleep_m[s.awake[k]];
    if (!has_room) return;
    blocks.pose[block] = pose;
    const Index first_node = blocks.lists[block].begin;
    b.for_threads(blocks.lists[block].end - first_node, [&](int k) {
      blocks.x_m[first_node + k] = body.nodes.position(blocks.nodes[first_node + k]);
    });
  }
  static constexpr float kNever = -1;
};

}  // namespace tactus
