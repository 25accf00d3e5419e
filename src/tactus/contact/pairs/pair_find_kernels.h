#pragma once
/// Finds which points of bodies are inside of other bodies, or of their own.
///
/// A point is inside of a body when it lies in one of the body's deformed cubes and, taken to rest there, is
/// inside of the surface at rest. The point touches that body's material at the same place: one point of
/// space, two points of matter, each a mean of up to eight nodes. The momentum that one gets the other loses,
/// so momentum and its moment are conserved.
#include "tactus/contact/pairs/pair_touch.h"

namespace tactus {

/// Block: group of points. On a GPU several threads look for each: all points wait for those that search.
struct FindPairs {
  static constexpr int kThreads = 512, kGrain = 4, kCandidates = 512, kClose = 1024;
  PairTable table;
  PairState state;
  TouchLaw law;
  Index touch_others;
  enum class Self : std::uint8_t { sleeps, inside, sought };
  /// A cube that a point may be in.
  struct Candidate {
    std::uint32_t order;
    int point;
  };
  struct Shared {
    int near[kThreads], near_count;  ///< patches that may hold points of the group, from the first of a row
    int sought[kGroupPoints], sought_count;  ///< points that are looked for there
    std::uint32_t first[kGroupPoints];       ///< cube of those patches that a point is in, in their order
    Vec3f x_m[kGroupPoints], q[kGroupPoints];
    Index cube[kGroupPoints];              ///< that the point is in; -1: none
    Self self[kGroupPoints];               ///< whether the point looks for its own body
    std::uint32_t free2_m2[kGroupPoints];  ///< bits of a squared distance: nothing of its own body that the
                                           ///< point may touch is nearer
    std::uint32_t active, sleep_m, reach_m;
    std::uint32_t close[kClose], close_count;  ///< pairs of patch n and a point: kGroupPoints n + point
    Candidate candidate[kCandidates];
    std::uint32_t candidates;
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index number = table.used_groups[b.index()];
    const PointGroup group = table.groups[number];
    const PatchBox box = state.patch_box[group.patch];
    const Index bodies = table.bodies.size();
    const bool is_self = may_meet_itself(number);
    Index others = 0, cut = 0;
    TACTUS_ROLLED
    for (Index body = 0; body < bodies; ++body) {
      if (!may_meet(group, box, body)) continue;
      ++others;
      cut += table.bodies[body].is_cut;
    }
    if (others == 0 && !is_self && state.group_active[number] == 0U) return;
    b.on_one_thread([&] { s.active = s.reach_m = 0; });
    // A point that is in a cube of the only body in question is in no other cube.
    const bool is_one = others == 1 && cut == 0 && !is_self;
    b.for_threads(group.count, [&](int t) {
      if (others > 0 || !rests(group, t))
        revisit(group, t, is_one, s);
      else
        s.cube[t] = -1;
    });
    if (is_self) search_itself(b, s, group, box);
    TACTUS_ROLLED
    for (Index body = 0; body < bodies; ++body) {
      if (!may_meet(group, box, body)) continue;
      const auto meets = [&](int t, Index cube) {
        Vec3f q = kMiddle;
        return is_in(group, t, cube, is_one, s, q);
      };
      search(
          b, s, group, table.bodies[body],
          [&](const PatchBox& patch) { return box.meets(patch, slack_m(group)); },
          [&](int t) { return s.cube[t] < 0; }, [](int) { return 0.F; },
          [&](const PlacedPatch& at, int t) { search_patch<Block>(at, t, s, meets); }, meets);
    }
    b.for_threads(group.count, [&](int t) { conclude(group, t, s); });
    if (is_self) note_sleep(b, s, group, number);
    b.on_one_thread([&] { state.group_active[number] = s.active; });
  }

 private:
  TACTUS_HD float slack_m(const PointGroup& group) const {
    return PairTable::slack_m(table.bodies[group.body]);
  }
  TACTUS_HD bool may_meet(const PointGroup& group, const PatchBox& box, Index body) const {
    return body != group.body && touch_others != 0 && box.meets(state.body_box[body], slack_m(group));
  }
  TACTUS_HD bool may_meet_itself(Index group) const {
    const Index body = table.groups[group].body;
    return table.bodies[body].self != SelfTouch::none &&
           state.self_motion[body].may_wake(state.group_sleep[group], table.bodies[body].spacing_m);
  }
  /// Data that decide which cubes of its own body a point may touch.
  struct OwnPlace {
    PointRest rest;
    Index part;
    SelfTouch self;
    Index is_cut;
    /// At q in that cube, or anywhere within `slack` spacings of there.
    TACTUS_HD bool may_touch(Vec3i cell, Index cube_part, Vec3f q, float slack) const {
      const Vec3f apart = vec_cast<float>(cell) + q - rest.p;
      if (self == SelfTouch::all && dot(apart, apart) > sqr(kSelfSpacings - slack)) return true;
      if (is_cut == 0) return false;
      const bool is_on_wall = dot(rest.wall, rest.wall) > 0.F;
      return (is_on_wall && dot(apart, rest.wall) > kBeyondWall - slack) || cube_part != part;
    }
  };
  /// Whether the material of a cube goes on in another one: they meet, and have the same nodes there. A point
  /// of a wall that moves with the one is at the surface of both.
  TACTUS_HD bool goes_on(Index cube, const CubePlace& b) const {
    if (cube < 0) return false;
    const SolidCube& a = table.cubes[cube];
    const Vec3i by = b.cell - a.cell;
    bool meet = false, same = true;
    for (int k = 0; k < 8; ++k) {
      const Vec3i at = Vec3i{k & 1, k >> 1 & 1, k >> 2} - by;
      if (((at.x | at.y | at.z) & ~1) != 0) continue;
      meet = true;
      same = same && a.row[k] == b.row[at.x + 2 * at.y + 4 * at.z];
    }
    return meet && same;
  }
  TACTUS_HD OwnPlace own_place(Index body, Index point) const {
    const PairBody& own = table.bodies[body];
    return {table.rest[point], table.part[table.rows[8 * point]], own.self, own.is_cut};
  }
  TACTUS_HD bool is_apart(Index point, Index body, const SolidCube& cube, Vec3f q) const {
    return cube.body != body || own_place(body, point).may_touch(cube.cell, table.part[cube.row[0]], q, 0.F);
  }
  /// A point is in its own material, to rounding, and must not touch it.
  static constexpr float kBeyondWall = 1e-3F;

  /// Whether a point touched nothing and need not look for its own body.
  TACTUS_HD bool rests(const PointGroup& group, int t) const {
    const Index i = group.first + t;
    return state.contact[i].cube < 0 && state.contact[i].touching == 0 &&
           !state.self_motion[group.body].may_wake(state.point_sleep[i], table.bodies[group.body].spacing_m);
  }
  /// Most points are in the cube in which they were.
  TACTUS_HD void revisit(const PointGroup& group, int t, bool is_one, Shared& s) const {
    const Index i = group.first + t;
    s.x_m[t] = table.bodies[group.body].nodes.position(table.points[i]);
    s.cube[t] = -1;
    const PairContact& contact = state.contact[i];
    Vec3f q = contact.q;
    if (contact.cube < 0 || !is_in(group, t, contact.cube, is_one, s, q)) return;
    s.cube[t] = contact.cube;
    s.q[t] = q;
  }
  /// Whether a cube holds x. @param q where, from a guess
  TACTUS_HD_CALLED bool place_in(Index c, Vec3f x, Vec3f& q) const {
    const SolidCube& cube = table.cubes[c];
    return CubeCorners::map(table.bodies[cube.body].nodes, cube).find(x, q);
  }
  /// Whether the point is in that cube, and need not be looked for elsewhere. @param q where, from a guess
  TACTUS_HD_CALLED bool is_in(const PointGroup& group, int t, Index c, bool is_one, const Shared& s,
                              Vec3f& q) const {
    const SolidCube& cube = table.cubes[c];
    if (!place_in(c, s.x_m[t], q) || !is_apart(group.first + t, group.body, cube, q)) return false;
    return is_one || table.distance(group.body, group.first + t, c, q).distance_m < 0.F;
  }

  static constexpr std::uint32_t kNone = ~0U;
  static constexpr int kCubeBits = 22;
  /// Where cube k of the n-th patch that is near comes among the cubes of all of those.
  TACTUS_HD static std::uint32_t order(int n, Index k) {
    static_assert(kThreads < 1 << (32 - kCubeBits) && kGroupPoints <= kThreads);
    return static_cast<std::uint32_t>(n) << kCubeBits | static_cast<std::uint32_t>(k);
  }
  static constexpr Vec3f kMiddle{0.5F, 0.5F, 0.5F};

  /// The n-th patch that is near; every `lanes`-th row of its cubes is looked at, from the lane-th on.
  struct PlacedPatch {
    Index patch;
    int n, lane, lanes;
  };
  /// look(patch, t) for all points t with seeks(t) and patches of a body with is_near(box); notes the first
  /// cube with meets(t, cube), which the point is in. Nothing farther from it than limit2_m2(t), squared,
  /// matters. On a GPU all threads share the work, of however few points.
  template <class Block, class N, class S, class C, class L, class M>
  TACTUS_HD void search(const Block& b, Shared& s, const PointGroup& group, const PairBody& body, N&& is_near,
                        S&& seeks, C&& limit2_m2, L&& look, M&& meets) const {
    TACTUS_ROLLED
    for (Index row = body.first_patch; row < body.end_patch; row += kThreads) {
      b.compact(
          min(Index(kThreads), body.end_patch - row),
          [&](int t) { return is_near(state.patch_box[row + t]); }, s.near, &s.near_count);
      b.compact(group.count, seeks, s.sought, &s.sought_count);
      const int patches = s.near_count, points = s.sought_count;
      if (patches == 0 || points == 0) continue;
      b.for_few(points, [&](int p) {
        s.first[s.sought[p]] = kNone;
        if (p == 0) s.candidates = s.close_count = 0;
      });
      const auto look_in = [&](int n, int t, int lane, int lanes) {
        look(PlacedPatch{row + s.near[n], n, lane, lanes}, t);
      };
      if constexpr (Block::kIsLoop) {
        b.for_few(patches * points, [&](int e) { look_in(e / points, s.sought[e % points], 0, 1); });
      } else {
        look_together(b, s, row, limit2_m2, look_in);
        try_candidates(b, s, row, meets);
      }
      b.for_few(points, [&](int p) {
        const int t = s.sought[p];
        if (s.first[t] == kNone) return;
        s.cube[t] = cube_of(s, row, s.first[t]);
        s.free2_m2[t] = 0;  // it is inside: seeks() need not look in the next row
        s.q[t] = kMiddle;
        place_in(s.cube[t], s.x_m[t], s.q[t]);
      });
    }
  }
  static constexpr int kMostLanes = 16;
  /// Threads share the cubes of the patches that are close to a point: most patches are to none.
  template <class Block, class C, class L>
  TACTUS_HD void look_together(const Block& b, Shared& s, Index row, C&& limit2_m2, L&& look_in) const {
    const int points = s.sought_count;
    b.for_few(s.near_count * points, [&](int e) {
      const int n = e / points, t = s.sought[e % points];
      if (state.patch_box[row + s.near[n]].distance2_m2(s.x_m[t]) > limit2_m2(t)) return;
      const std::uint32_t place = atomic_fetch_add(s.close_count, 1U);
      if (place < kClose)
        s.close[place] = static_cast<std::uint32_t>(kGroupPoints * n + t);
      else
        look_in(n, t, 0, 1);
    });
    const int close = static_cast<int>(min(s.close_count, static_cast<std::uint32_t>(kClose))),
              lanes = clamp(kThreads / max(close, 1), 1, kMostLanes);
    b.for_few(close * lanes, [&](int e) {
      const auto pair = static_cast<int>(s.close[e % close]);
      look_in(pair / kGroupPoints, pair % kGroupPoints, e / close, lanes);
    });
  }
  TACTUS_HD Index cube_of(const Shared& s, Index row, std::uint32_t order) const {
    const IndexRange cubes = table.patch_cubes.ranges[row + s.near[order >> kCubeBits]];
    return table.patch_cubes.values[cubes.begin + static_cast<Index>(order & ((1U << kCubeBits) - 1U))];
  }
  /// All at once: a thread that tries one after the other keeps the block waiting.
  template <class Block, class M>
  TACTUS_HD void try_candidates(const Block& b, Shared& s, Index row, M&& meets) const {
    b.for_few(static_cast<int>(min(s.candidates, static_cast<std::uint32_t>(kCandidates))), [&](int e) {
      const Candidate& c = s.candidate[e];
      if (meets(c.point, cube_of(s, row, c.order))) atomic_min(s.first[c.point], c.order);
    });
  }
  /// f(k, squared distance) for cubes of a patch whose boxes are no farther than limit2_m2() squared, until f
  /// says false. Looks at a row of them at once.
  template <class Block, class L, class F>
  TACTUS_HD void for_cubes_within(const PlacedPatch& at, Vec3f x, L&& limit2_m2, F&& f) const {
    constexpr int kRow = Block::kIsLoop ? 16 : 4;
    const IndexRange cubes = table.patch_cubes.ranges[at.patch];
    if (state.patch_box[at.patch].distance2_m2(x) > limit2_m2()) return;
    TACTUS_ROLLED
    for (Index row = cubes.begin + kRow * at.lane; row < cubes.end; row += kRow * at.lanes) {
      const int count = min(Index(kRow), cubes.end - row);
      float away2_m2[kRow];
      if (state.cube_boxes.distances2_m2<kRow>(row, count, x, away2_m2) > limit2_m2()) continue;
      TACTUS_ROLLED
      for (int k = 0; k < count; ++k)
        if (away2_m2[k] <= limit2_m2() && !f(row + k - cubes.begin, away2_m2[k])) return;
    }
  }
  template <class Block, class M>
  TACTUS_HD void search_patch(const PlacedPatch& at, int t, Shared& s, M&& meets) const {
    const auto within2_m2 = [&] { return atomic_load(s.first[t]) < order(at.n, 0) ? -1.F : 0.F; };
    for_cubes_within<Block>(at, s.x_m[t], within2_m2,
                            [&](Index k, float) { return !note_first<Block>(at, t, k, s, meets); });
  }
  /// Returns whether the point is known to be in that cube. A GPU notes that it may be, where there is
  /// capacity.
  template <class Block, class M>
  TACTUS_HD bool note_first(const PlacedPatch& at, int t, Index k, Shared& s, M&& meets) const {
    if constexpr (!Block::kIsLoop) {
      const std::uint32_t place = atomic_fetch_add(s.candidates, 1U);
      if (place < static_cast<std::uint32_t>(kCandidates)) {
        s.candidate[place] = {order(at.n, k), t};
        return false;
      }
    }
    if (!meets(t, table.patch_cubes.values[table.patch_cubes.ranges[at.patch].begin + k])) return false;
    atomic_min(s.first[t], order(at.n, k));
    return true;
  }

  /// Patches and cubes of the point's own body; notes how far they are.
  template <class Block>
  TACTUS_HD void search_itself(const Block& b, Shared& s, const PointGroup& group,
                               const PatchBox& box) const {
    const PairBody& body = table.bodies[group.body];
    const SelfMotion& motion = state.self_motion[group.body];
    b.for_threads(group.count, [&](int t) {
      SelfSleep& sleep = state.point_sleep[group.first + t];
      if (touches_nothing_own(body, group.first + t)) sleep = {motion.moved, kForever_m};
      // A point that touches its own body is looked at every time.
      const bool sleeps = !motion.may_wake(sleep, body.spacing_m);
      const bool is_there = s.cube[t] >= 0 && table.cubes[s.cube[t]].body == group.body;
      s.self[t] = is_there ? Self::inside : sleeps ? Self::sleeps : Self::sought;
      const float reach_m = is_there ? 0.F : reach_of(sleep, body);
      s.free2_m2[t] = std::bit_cast<std::uint32_t>(sqr(reach_m));
      if (s.self[t] == Self::sought) atomic_max(s.reach_m, std::bit_cast<std::uint32_t>(reach_m));
    });
    const float farthest_m = std::bit_cast<float>(s.reach_m);
    const auto meets = [&](int t, Index cube) { return meets_own(group, t, cube, s); };
    search(
        b, s, group, body, [&](const PatchBox& patch) { return box.meets(patch, farthest_m); },
        [&](int t) { return s.self[t] == Self::sought && s.free2_m2[t] > 0U; },
        [&](int t) { return std::bit_cast<float>(atomic_load(s.free2_m2[t])); },
        [&](const PlacedPatch& at, int t) { search_own_patch<Block>(group, at, t, s, meets); }, meets);
    const float least_m = least_sleep_m(body);
    b.for_threads(group.count, [&](int t) {
      if (s.self[t] != Self::sleeps)
        state.point_sleep[group.first + t] = {
            motion.moved, max(tactus::sqrt(std::bit_cast<float>(s.free2_m2[t])), least_m)};
    });
  }
  /// A point on a wall of a closed cut has the other wall beside it always. It is looked for again once nodes
  /// have moved by half of that, in spacings.
  static constexpr float kWallSleep = 0.01F;
  TACTUS_HD static float least_sleep_m(const PairBody& body) {
    return body.is_cut != 0 ? kWallSleep * body.spacing_m : 0.F;
  }
  static constexpr float kForever_m = 1e30F;
  /// Whether there is nothing of its own body that a point may touch: it is on no wall, and all hangs
  /// together.
  TACTUS_HD bool touches_nothing_own(const PairBody& body, Index point) const {
    const Vec3f wall = table.rest[point].wall;
    return body.self == SelfTouch::walls && body.parts == 1 && dot(wall, wall) == 0.F;
  }
  /// So far a point looks: twice as far as its body was the last time. A near cube would be found near, and
  /// far cubes are looked for less and less often.
  TACTUS_HD static float reach_of(const SelfSleep& last, const PairBody& body) {
    constexpr float kLeast = 0.1F;  // in spacings
    return clamp(2 * last.free_m, kLeast * body.spacing_m, SelfSleep::kFarthest * body.spacing_m);
  }

  /// The least of distances doesn't depend on their order: nothing is left out that could change it.
  template <class Block, class M>
  TACTUS_HD void search_own_patch(const PointGroup& group, const PlacedPatch& at, int t, Shared& s,
                                  M&& meets) const {
    const float least2_m2 = sqr(least_sleep_m(table.bodies[group.body]));
    const auto within2_m2 = [&] {
      const float free2_m2 = std::bit_cast<float>(atomic_load(s.free2_m2[t]));
      return free2_m2 > least2_m2 ? free2_m2 : 0.F;
    };
    const Index first = table.patch_cubes.ranges[at.patch].begin;
    if (state.patch_box[at.patch].distance2_m2(s.x_m[t]) > within2_m2()) return;
    const OwnPlace own = own_place(group.body, group.first + t);
    for_cubes_within<Block>(at, s.x_m[t], within2_m2, [&](Index k, float away2_m2) {
      // No point of the cube is farther from its middle at rest than 0.87.
      const CubePlace& place = state.cube_places[first + k];
      if (!own.may_touch(place.cell, place.part, kMiddle, 0.87F) || goes_on(own.rest.cube, place))
        return true;
      if (away2_m2 > 0.F || s.cube[t] >= 0) {
        atomic_min(s.free2_m2[t], std::bit_cast<std::uint32_t>(away2_m2));
        return away2_m2 > 0.F;
      }
      return !note_first<Block>(at, t, k, s, meets);
    });
  }
  /// Whether the point is in a cube of its own body; else it is noted how far it is from the material there.
  TACTUS_HD_CALLED bool meets_own(const PointGroup& group, int t, Index c, Shared& s) const {
    Vec3f q = kMiddle;
    if (is_in(group, t, c, false, s, q)) return true;
    atomic_min(s.free2_m2[t], std::bit_cast<std::uint32_t>(sqr(clearance_m(c, s.x_m[t], q))));
    return false;
  }
  /// How far x is from the material of a cube at least; 0 where q is not where the cube has it. Both sides of
  /// a cut have whole cubes, which overlap: a point of one wall may be well inside of the other's cube.
  TACTUS_HD float clearance_m(Index c, Vec3f x, Vec3f q) const {
    constexpr float kSqueezed = 0.5F;  // of its length at rest, at most
    const SolidCube& cube = table.cubes[c];
    const PairBody& body = table.bodies[cube.body];
    if (!CubeMap::is_in(q, 1.F)) return 0.F;
    const Vec3f off_m = CubeCorners::map(body.nodes, cube).at(q) - x;
    if (!(dot(off_m, off_m) < sqr(1e-3F * body.spacing_m))) return 0.F;
    const Vec3f inside{clamp(q.x, 0.F, 1.F), clamp(q.y, 0.F, 1.F), clamp(q.z, 0.F, 1.F)};
    const float out_m = body.spacing_m * length(q - inside);
    return kSqueezed * max(out_m, table.samples.at(c, inside).distance_m - out_m);
  }
  /// Notes the sleep of a group whose points were just looked at.
  template <class Block>
  TACTUS_HD void note_sleep(const Block& b, Shared& s, const PointGroup& group, Index number) const {
    const SelfMotion& motion = state.self_motion[group.body];
    const float unit_m = 2 * SelfMotion::kUnit * table.bodies[group.body].spacing_m;
    b.on_one_thread([&] { s.sleep_m = std::bit_cast<std::uint32_t>(1e30F); });
    b.for_threads(group.count, [&](int t) {
      const SelfSleep& sleep = state.point_sleep[group.first + t];
      const float left = sleep.free_m - unit_m * static_cast<float>(motion.moved - sleep.since);
      atomic_min(s.sleep_m, std::bit_cast<std::uint32_t>(max(left, 0.F)));
    });
    b.on_one_thread([&] { state.group_sleep[number] = {motion.moved, std::bit_cast<float>(s.sleep_m)}; });
  }

  TACTUS_HD void conclude(const PointGroup& group, int t, Shared& s) const {
    const Index i = group.first + t, c = s.cube[t];
    PairContact& contact = state.contact[i];
    if (c < 0 && contact.cube < 0 && contact.touching == 0) return;
    if (c >= 0 && PairTouch{table, state, law}.touch(group.body, i, c, s.q[t], s.x_m[t])) {
      atomic_or(s.active, 1U);
      return;
    }
    if (contact.touching == 1) add_pair_weights(table, state, i, contact, -1);
    if (contact.touching != 0) contact.touching = contact.touching < kLingering ? contact.touching + 1 : 0;
    contact.cube = c;
    contact.q = s.q[t];
    if (contact.touching != 0 || c >= 0) atomic_or(s.active, 1U);
  }
};

}  // namespace tactus
