#pragma once
/// Boxes of bodies that touch one another, of their patches and of their cubes, as they are deformed now.
#include "tactus/compute/fold.h"
#include "tactus/contact/pairs/pair_views.h"

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
    // A CPU has no lanes to fill, and the results of several would have to be put together.
    const int lanes = min(Index(Block::kIsLoop ? 1 : kThreads), own.end - own.begin);
    b.for_threads(lanes, [&](int t) {
      PatchBox box = PatchBox::empty();
      float way2 = 0;
      for (Index k = own.begin + t; k < own.end; k += lanes) {
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
    fold<kThreads>(b, lanes, [&](int t, int other) {
      s.of_thread[t].take(s.of_thread[other]);
      s.way2_m2[t] = max(s.way2_m2[t], s.way2_m2[other]);
    });
    b.on_one_thread([&] {
      state.patch_box[b.index()] = lanes > 0 ? s.of_thread[0] : PatchBox::empty();
      state.patch_displacement_m[b.index()] = lanes > 0 ? tactus::sqrt(s.way2_m2[0]) : 0.F;
    });
  }
};

/// Block: body. The box of its patches, and that of the groups of its points that have to look for their own
/// body.
struct BoundBodies {
  static constexpr int kThreads = 128;
  PairTable table;
  PairState state;
  struct Shared {
    PatchBox of_thread[kThreads];
    float displacement_m[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const PairBody& body = table.bodies[b.index()];
    b.for_each_thread([&](int t) {
      PatchBox box = PatchBox::empty();
      float way = 0;
      for (Index p = body.first_patch + t; p < body.end_patch; p += kThreads) {
        way = max(way, state.patch_displacement_m[p]);
        box.take(state.patch_box[p]);
      }
      s.of_thread[t] = box;
      s.displacement_m[t] = way;
    });
    fold<kThreads>(b, kThreads, [&](int t, int other) {
      s.of_thread[t].take(s.of_thread[other]);
      s.displacement_m[t] = max(s.displacement_m[t], s.displacement_m[other]);
    });
    b.on_one_thread([&] {
      const PatchBox box = s.of_thread[0];
      state.body_box[b.index()] = box;
      SelfMotion& motion = state.self_motion[b.index()];
      const Vec3f middle = 0.5F * (box.min_m + box.max_m);
      motion.moved += SelfMotion::units(s.displacement_m[0], body.spacing_m);
      motion.shift_m = middle - motion.middle_m;
      motion.middle_m = middle;
      state.wake_box[b.index()] = PatchBox::empty();
    });
    if (body.self == SelfTouch::none) return;
    b.for_each_thread([&](int t) {
      PatchBox box = PatchBox::empty();
      for (Index g = body.first_group + t; g < body.end_group; g += kThreads) {
        const PointGroup& group = table.groups[g];
        if (group.count > 0 && state.self_motion[b.index()].may_wake(state.group_sleep[g], body.spacing_m))
          box.take(state.patch_box[group.patch]);
      }
      s.of_thread[t] = box;
    });
    fold<kThreads>(b, kThreads, [&](int t, int other) { s.of_thread[t].take(s.of_thread[other]); });
    b.on_one_thread([&] { state.wake_box[b.index()] = s.of_thread[0]; });
  }
};

/// Block: patch. The boxes of its cubes, if points may be looked for there.
struct BoundCubes {
  static constexpr int kThreads = 64, kGrain = 8;
  PairTable table;
  PairState state;
  Index touch_others;
  struct Shared {};
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index body = table.patches[b.index()].body;
    const float reach_m = SelfSleep::kFarthest * table.bodies[body].spacing_m;
    if (!state.patch_box[b.index()].meets(state.wake_box[body], reach_m) && !meets_others(b.index(), body))
      return;
    const ContactNodes& nodes = table.bodies[body].nodes;
    const IndexRange cubes = table.patch_cubes.ranges[b.index()];
    b.for_range(cubes.end - cubes.begin, [&](int k) {
      const SolidCube& cube = table.cubes[table.patch_cubes.values[cubes.begin + k]];
      PatchBox box = PatchBox::empty();
      for (int n = 0; n < 8; ++n) {
        const Vec3f x = nodes.x_m[cube.node[n]];
        box = {min(box.min_m, x), max(box.max_m, x)};
      }
      state.cube_boxes.set(cubes.begin + k, box);
    });
  }

 private:
  TACTUS_HD bool meets_others(Index patch, Index body) const {
    if (touch_others == 0) return false;
    for (Index other = 0; other < table.bodies.size(); ++other) {
      const float slack_m = PairTable::slack_m(table.bodies[other]);
      if (other != body && state.patch_box[patch].meets(state.body_box[other], slack_m)) return true;
    }
    return false;
  }
};

}  // namespace tactus
