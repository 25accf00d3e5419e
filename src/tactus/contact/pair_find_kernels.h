#pragma once
/// Finds which points of bodies are inside of other bodies, or of their own, and what is to be done to them.
///
/// A point is inside of a body when it lies in one of the body's deformed cubes and, taken to rest there, is
/// inside of the surface at rest. That body's material at the same place is what the point touches: one
/// point of space, two points of matter, each a mean of up to eight nodes. What one gets the other loses, so
/// momentum and its moment are conserved.
#include "tactus/contact/pair_views.h"
#include "tactus/contact/response_kernels.h"

namespace tactus {

/// Block: patch. The box of its nodes; no point touches in its cubes so far.
struct BoundPatches {
  static constexpr int kThreads = 64, kGrain = 8;
  PairTable table;
  PairState state;
  struct Shared {
    PatchBox of_thread[kThreads];
    float way2_m2[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const CubePatch& patch = table.patches[b.index()];
    const ContactNodes& nodes = table.bodies[patch.body].nodes;
    const bool is_self = table.bodies[patch.body].self != SelfTouch::none;
    const Vec3f shift = state.self_motion[patch.body].shift_m;
    const IndexRange own = table.patch_nodes.ranges[b.index()], cubes = table.patch_cubes.ranges[b.index()];
    const int lanes = min(Index(kThreads), own.end - own.begin);
    b.for_threads(lanes, [&](int t) {
      PatchBox box = PatchBox::empty();
      float way2 = 0;
      for (Index k = own.begin + t; k < own.end; k += kThreads) {
        const Vec3f x = nodes.x_m[table.patch_nodes.values[k]];
        box = {min(box.min_m, x), max(box.max_m, x)};
        if (!is_self) continue;
        const Vec3f way = x - state.last_x_m[k] - shift;
        way2 = max(way2, dot(way, way));
        state.last_x_m[k] = x;
      }
      s.of_thread[t] = box;
      s.way2_m2[t] = way2;
      for (Index c = cubes.begin + t; c < cubes.end; c += lanes)
        state.cube_list[table.patch_cubes.values[c]] = 0;
    });
    b.on_one_thread([&] {
      PatchBox box = PatchBox::empty();
      float way2 = 0;
      for (int t = 0; t < lanes; ++t) {
        box = {min(box.min_m, s.of_thread[t].min_m), max(box.max_m, s.of_thread[t].max_m)};
        way2 = max(way2, s.way2_m2[t]);
      }
      state.patch_box[b.index()] = box;
      state.patch_way_m[b.index()] = tactus::sqrt(way2);
    });
  }
};

/// Block: body. The box of its patches.
struct BoundBodies {
  static constexpr int kThreads = 128;
  PairTable table;
  PairState state;
  struct Shared {
    PatchBox of_thread[kThreads];
    float way_m[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const PairBody& body = table.bodies[b.index()];
    b.for_each_thread([&](int t) {
      PatchBox box = PatchBox::empty();
      float way = 0;
      for (Index p = body.first_patch + t; p < body.end_patch; p += kThreads) {
        way = max(way, state.patch_way_m[p]);
        box.min_m = min(box.min_m, state.patch_box[p].min_m);
        box.max_m = max(box.max_m, state.patch_box[p].max_m);
      }
      s.of_thread[t] = box;
      s.way_m[t] = way;
    });
    b.on_one_thread([&] {
      PatchBox box = s.of_thread[0];
      float way = s.way_m[0];
      for (int t = 1; t < kThreads; ++t) {
        box = {min(box.min_m, s.of_thread[t].min_m), max(box.max_m, s.of_thread[t].max_m)};
        way = max(way, s.way_m[t]);
      }
      state.body_box[b.index()] = box;
      SelfMotion& motion = state.self_motion[b.index()];
      const Vec3f middle = 0.5F * (box.min_m + box.max_m);
      motion.moved += SelfMotion::units(way, body.spacing_m);
      motion.shift_m = middle - motion.middle_m;
      motion.middle_m = middle;
    });
  }
};

TACTUS_HD inline std::uint32_t signed_units(float weight, int sign) {
  const std::uint32_t units = PointWeights::quantized(weight);
  return sign > 0 ? units : 0U - units;
}
TACTUS_HD inline void add_row_weight(const PairState& state, Index row, std::uint32_t units) {
  if (units != 0U) atomic_add(state.row_weight[row], units);
}
/// Of a point and of where it touches, to their rows.
TACTUS_HD inline void add_pair_weights(const PairTable& table, const PairState& state, Index i,
                                       const PairContact& contact, int sign) {
  const EmbeddedPoint& point = table.points[i];
  const SolidCube& cube = table.cubes[contact.cube];
  for (int k = 0; k < 8; ++k) {
    if (point.weight[k] != 0.F)
      add_row_weight(state, table.rows[8 * i + k], signed_units(point.weight[k], sign));
    add_row_weight(state, cube.row[k], signed_units(CubeMap::weight(contact.q, k), sign));
  }
}

/// Block: group of points.
struct FindPairs {
  static constexpr int kThreads = kGroupPoints, kGrain = 4;
  PairTable table;
  PairState state;
  float restitution, friction;
  Index touch_others;
  struct Shared {
    int near[kThreads], near_count;  ///< patches that may hold points of the group, from the first of a row
    float reach2_m2[kThreads];       ///< of those: no cube is larger
    Vec3f x_m[kThreads], q[kThreads];
    Index cube[kThreads];    ///< that the point is in; -1: none
    float free_m[kThreads];  ///< no cube of its own body is nearer
    std::uint32_t active;
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const PointGroup group = table.groups[b.index()];
    if (group.count == 0) return;  // room
    const PatchBox box = state.patch_box[group.patch];
    const Index bodies = table.bodies.size();
    const bool is_self = may_meet_itself(b.index());
    Index others = 0, cut = 0;
    for (Index body = 0; body < bodies; ++body) {
      if (!may_meet(group, box, body)) continue;
      ++others;
      cut += table.bodies[body].is_cut;
    }
    if (others == 0 && !is_self && state.group_active[b.index()] == 0U) return;
    b.on_one_thread([&] { s.active = 0; });
    // A point that is in a cube of the only body in question is in no other cube.
    const bool is_one = others == 1 && cut == 0 && !is_self;
    b.for_threads(group.count, [&](int t) { look(group, t, is_one, s); });
    if (is_self) search_itself(b, s, group, box);
    for (Index body = 0; body < bodies; ++body) {
      if (!may_meet(group, box, body)) continue;
      const Index end = table.bodies[body].end_patch;
      for (Index first = table.bodies[body].first_patch; first < end; first += kThreads) {
        const auto is_near = [&](int t) { return box.meets(state.patch_box[first + t], slack_m(group)); };
        b.compact(min(Index(kThreads), end - first), is_near, s.near, &s.near_count);
        b.for_threads(s.near_count, [&](int n) { s.reach2_m2[n] = largest_cube2_m2(first + s.near[n]); });
        b.for_threads(group.count, [&](int t) { search(group, t, first, is_one, s); });
      }
    }
    b.for_threads(group.count, [&](int t) { conclude(group, t, s); });
    b.on_one_thread([&] {
      state.group_active[b.index()] = s.active;
      if (is_self) state.group_sleep[b.index()] = sleep_of(group);
    });
  }

 private:
  /// Points may stick out of all cubes by that much.
  TACTUS_HD float slack_m(const PointGroup& group) const { return 0.1F * table.bodies[group.body].spacing_m; }
  TACTUS_HD bool may_meet(const PointGroup& group, const PatchBox& box, Index body) const {
    return body != group.body && touch_others != 0 && box.meets(state.body_box[body], slack_m(group));
  }
  TACTUS_HD static Vec3f middle_of(const ContactNodes& nodes, const SolidCube& cube) {
    return 0.5F * (nodes.x_m[cube.node[0]] + nodes.x_m[cube.node[7]]);
  }
  TACTUS_HD bool may_meet_itself(Index group) const {
    const Index body = table.groups[group].body;
    return table.bodies[body].self != SelfTouch::none &&
           state.self_motion[body].may_wake(state.group_sleep[group], table.bodies[body].spacing_m);
  }
  /// Squared: no point of a cube of the patch is farther from the cube's middle.
  TACTUS_HD float largest_cube2_m2(Index patch) const {
    const IndexRange cubes = table.patch_cubes.ranges[patch];
    const ContactNodes& nodes = table.bodies[table.patches[patch].body].nodes;
    float most = 0;
    for (Index c = cubes.begin; c < cubes.end; ++c) {
      const SolidCube& cube = table.cubes[table.patch_cubes.values[c]];
      const Vec3f middle = middle_of(nodes, cube);
      for (int k = 0; k < 7; ++k) {
        const Vec3f d = nodes.x_m[cube.node[k]] - middle;
        most = max(most, dot(d, d));
      }
    }
    return 1.001F * most;
  }
  TACTUS_HD bool is_apart(Index point, Index group_body, const SolidCube& cube, Vec3f q) const {
    return cube.body != group_body || may_touch(point, cube, q, 0.F);
  }
  /// Whether a point may touch its own body there, or anywhere within `slack` spacings.
  TACTUS_HD bool may_touch(Index point, const SolidCube& cube, Vec3f q, float slack) const {
    const PointRest& rest = table.rest[point];
    const Vec3f apart = vec_cast<float>(cube.cell) + q - rest.p;
    const PairBody& body = table.bodies[cube.body];
    if (body.self == SelfTouch::all && dot(apart, apart) > sqr(kSelfSpacings - slack)) return true;
    return body.is_cut != 0 && (dot(apart, rest.wall) > kBeyondWall - slack * length(rest.wall) ||
                                table.part[table.rows[8 * point]] != table.part[cube.row[0]]);
  }
  /// A point is in its own material, to rounding, and must not touch it.
  static constexpr float kBeyondWall = 1e-3F;

  /// Most points are in the cube in which they were.
  TACTUS_HD void look(const PointGroup& group, int t, bool is_one, Shared& s) const {
    const Index i = group.first + t;
    s.x_m[t] = table.bodies[group.body].nodes.position(table.points[i]);
    s.cube[t] = -1;
    const PairContact& contact = state.contact[i];
    if (contact.cube >= 0) settle(group, t, contact.cube, contact.q, is_one, s);
  }
  /// Whether the point is in that cube, and need not be looked for elsewhere.
  TACTUS_HD bool settle(const PointGroup& group, int t, Index c, Vec3f q, bool is_one, Shared& s) const {
    const SolidCube& cube = table.cubes[c];
    const CubeMap map = CubeCorners::map(table.bodies[cube.body].nodes, cube);
    if (!map.find(s.x_m[t], q) || !is_apart(group.first + t, group.body, cube, q)) return false;
    if (!is_one && !(table.samples.at(c, q).distance_m < 0.F)) return false;
    s.cube[t] = c;
    s.q[t] = q;
    return true;
  }
  TACTUS_HD void search(const PointGroup& group, int t, Index first, bool is_one, Shared& s) const {
    const Vec3f x = s.x_m[t];
    for (int n = 0; n < s.near_count && s.cube[t] < 0; ++n) {
      const Index p = first + s.near[n];
      if (!state.patch_box[p].holds(x)) continue;
      const IndexRange cubes = table.patch_cubes.ranges[p];
      const ContactNodes& nodes = table.bodies[table.patches[p].body].nodes;
      const Vec3f middle{0.5F, 0.5F, 0.5F};
      for (Index k = cubes.begin; k < cubes.end; ++k) {
        const Index c = table.patch_cubes.values[k];
        const SolidCube& cube = table.cubes[c];
        const Vec3f d = x - middle_of(nodes, cube);
        if (!(dot(d, d) <= s.reach2_m2[n])) continue;
        if (settle(group, t, c, middle, is_one, s)) break;
      }
    }
  }

  /// Patches and cubes of the point's own body; notes how far they are.
  template <class Block>
  TACTUS_HD void search_itself(const Block& b, Shared& s, const PointGroup& group,
                               const PatchBox& box) const {
    const PairBody& body = table.bodies[group.body];
    const SelfMotion& motion = state.self_motion[group.body];
    b.for_threads(group.count, [&](int t) {
      // What touches its own body is looked at every time; what sleeps isn't: < 0.
      const bool sleeps = !motion.may_wake(state.point_sleep[group.first + t], body.spacing_m);
      const bool is_there = s.cube[t] >= 0 && table.cubes[s.cube[t]].body == group.body;
      s.free_m[t] = is_there ? 0.F : sleeps ? -1.F : farthest_m(body);
    });
    for (Index first = body.first_patch; first < body.end_patch; first += kThreads) {
      const auto is_near = [&](int t) { return box.meets(state.patch_box[first + t], farthest_m(body)); };
      b.compact(min(Index(kThreads), body.end_patch - first), is_near, s.near, &s.near_count);
      b.for_threads(s.near_count, [&](int n) { s.reach2_m2[n] = largest_cube2_m2(first + s.near[n]); });
      b.for_threads(group.count, [&](int t) {
        if (s.free_m[t] > 0.F) search_itself(group, t, first, s);
      });
    }
    const float least_m = body.is_cut != 0 ? kWallSleep * body.spacing_m : 0.F;
    b.for_threads(group.count, [&](int t) {
      if (s.free_m[t] >= 0.F) state.point_sleep[group.first + t] = {motion.moved, max(s.free_m[t], least_m)};
    });
  }
  /// What lies on a wall has the other wall beside it always. It is looked for again once nodes have moved by
  /// half of that, in spacings.
  static constexpr float kWallSleep = 0.01F;
  /// No more is asked of how far the point's own body is.
  TACTUS_HD static float farthest_m(const PairBody& body) { return 1.5F * body.spacing_m; }
  TACTUS_HD void search_itself(const PointGroup& group, int t, Index first, Shared& s) const {
    const Vec3f x = s.x_m[t], middle{0.5F, 0.5F, 0.5F};
    const ContactNodes& nodes = table.bodies[group.body].nodes;
    for (int n = 0; n < s.near_count; ++n) {
      const Index p = first + s.near[n];
      const float reach = tactus::sqrt(s.reach2_m2[n]);
      if (state.patch_box[p].distance2_m2(x) > sqr(s.free_m[t])) continue;
      const IndexRange cubes = table.patch_cubes.ranges[p];
      for (Index k = cubes.begin; k < cubes.end; ++k) {
        const Index c = table.patch_cubes.values[k];
        const SolidCube& cube = table.cubes[c];
        // No point of the cube is farther from its middle than 0.87.
        if (!may_touch(group.first + t, cube, middle, 0.87F)) continue;
        const Vec3f d = x - middle_of(nodes, cube);
        const float d2 = dot(d, d);
        if (d2 >= sqr(s.free_m[t] + reach)) continue;
        s.free_m[t] = max(tactus::sqrt(d2) - reach, 0.F);
        if (s.free_m[t] == 0.F && (s.cube[t] >= 0 || settle(group, t, c, middle, false, s))) return;
      }
    }
  }
  /// Of a group whose points were just looked at.
  TACTUS_HD SelfSleep sleep_of(const PointGroup& group) const {
    const SelfMotion& motion = state.self_motion[group.body];
    const float unit_m = 2 * SelfMotion::kUnit * table.bodies[group.body].spacing_m;
    SelfSleep least{motion.moved, 1e30F};
    for (Index i = group.first; i < group.first + group.count; ++i) {
      const SelfSleep& sleep = state.point_sleep[i];
      const float left = sleep.free_m - unit_m * static_cast<float>(motion.moved - sleep.since);
      least.free_m = min(least.free_m, left);
    }
    return least;
  }

  TACTUS_HD void conclude(const PointGroup& group, int t, Shared& s) const {
    const Index i = group.first + t, c = s.cube[t];
    PairContact& contact = state.contact[i];
    if (c >= 0 && touch(group, i, c, s.q[t], s.x_m[t], contact)) {
      atomic_or(s.active, 1U);
      return;
    }
    if (contact.touching == 1) add_weights(i, contact, -1);
    if (contact.touching != 0) contact.touching = contact.touching < kLingering ? contact.touching + 1 : 0;
    contact.cube = c;
    contact.q = s.q[t];
    if (contact.touching != 0 || c >= 0) atomic_or(s.active, 1U);
  }
  /// Returns whether the point is inside, and something can be done to it or to what it touches. The normal
  /// is that of the distance at rest, taken through the deformation; gap = distance / |its gradient|.
  TACTUS_HD bool touch(const PointGroup& group, Index i, Index c, Vec3f q, Vec3f x,
                       PairContact& contact) const {
    const RestDistance rest = table.samples.at(c, q);
    if (!(rest.distance_m < 0.F)) return false;
    const SolidCube& cube = table.cubes[c];
    const EmbeddedPoint& point = table.points[i];
    const PairBody &body = table.bodies[group.body], &other = table.bodies[cube.body];
    const CubeMap::Jacobian jacobian = CubeCorners::map(other.nodes, cube).jacobian(q);
    const float steepness = length(rest.gradient_m) / other.spacing_m;  // 1, less where sides are as near
    const Vec3f gradient = jacobian.gradient(rest.gradient_m);
    const float slope = length(gradient);
    if (!(steepness > 0.1F) || !(slope > 0.F) || !(moves(body, point) || moves(other, cube, q))) return false;
    const Vec3f n = (1.F / slope) * gradient;
    const float depth = -rest.distance_m * steepness / slope;

    const Vec3f rel = body.nodes.velocity(point) - CubeCorners::velocity(other.nodes, cube, q);
    const bool same = contact.touching != 0 && table.cubes[contact.held_cube].body == cube.body;
    const Vec3f held =
        same ? CubeCorners::map(other.nodes, table.cubes[contact.held_cube]).at(contact.held_q) : x;
    const Vec3f away = x - held, slide = away - dot(away, n) * n;
    const float distance = length(slide), most = friction * depth;
    Vec3f push = depth * n - (distance > most ? most / distance : 1.F) * slide;
    contact.held_cube = c;
    contact.held_q = q + jacobian.solve(push);
    // What was put into one another must not be shot apart.
    const float farthest = kLargestPush * min(body.spacing_m, other.spacing_m), far = length(push);
    if (far > farthest) push *= farthest / far;
    const bool stays = contact.touching == 1 && contact.cube == c;
    if (stays)
      shift_weights(contact, q);
    else if (contact.touching == 1)
      add_weights(i, contact, -1);
    contact.kick_m_s = touch_kick(rel, n, contact.touching == 1 ? 0.F : restitution, friction);
    contact.push_m = push;
    contact.x_m = x;
    contact.depth_m = depth;
    contact.touching = 1;
    contact.cube = c;
    contact.q = q;
    if (!stays) add_weights(i, contact, 1);
    return true;
  }
  /// In one correction, in spacings.
  static constexpr float kLargestPush = 0.1F;

  TACTUS_HD static bool moves(const PairBody& body, const EmbeddedPoint& p) {
    if (body.nodes.has_stopped()) return false;
    for (int k = 0; k < 8; ++k) {
      if (p.weight[k] != 0.F && !body.nodes.is_held(p.node[k])) return true;
    }
    return false;
  }
  TACTUS_HD static bool moves(const PairBody& body, const SolidCube& cube, Vec3f q) {
    if (body.nodes.has_stopped()) return false;
    for (int k = 0; k < 8; ++k) {
      if (CubeMap::weight(q, k) != 0.F && !body.nodes.is_held(cube.node[k])) return true;
    }
    return false;
  }
  TACTUS_HD void add_weights(Index i, const PairContact& contact, int sign) const {
    add_pair_weights(table, state, i, contact, sign);
  }
  /// What touches in the same cube as before hardly moves there, most often.
  TACTUS_HD void shift_weights(const PairContact& contact, Vec3f q) const {
    const SolidCube& cube = table.cubes[contact.cube];
    for (int k = 0; k < 8; ++k)
      add_row_weight(
          state, cube.row[k],
          signed_units(CubeMap::weight(q, k), 1) + signed_units(CubeMap::weight(contact.q, k), -1));
  }
};

}  // namespace tactus
