/// A blade whose shape is known, found and followed by what cameras see of it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "support/message_of.h"
#include "track/track_scene.h"

namespace tactus {
namespace {

using test::at_pose;
using test::Errors;
using test::kFrame_s;
using test::Room;
using test::some_pose;
using test::stroke;

bool is_long() { return std::getenv("TACTUS_LONG_TESTS") != nullptr; }

TriangleMesh ball(Vec3d center_m, double radius_m) {
  TriangleMesh mesh;
  constexpr int kSides = 16;
  for (int i = 1; i < kSides; ++i) {
    for (int k = 0; k < kSides; ++k) {
      const double a = M_PI * i / kSides, b = 2 * M_PI * k / kSides;
      mesh.positions_m.push_back(vec_cast<float>(
          center_m + radius_m * Vec3d{std::sin(a) * std::cos(b), std::cos(a), std::sin(a) * std::sin(b)}));
    }
  }
  for (Index i = 0; i + 2 < kSides; ++i) {
    for (Index k = 0; k < kSides; ++k) {
      const Index p = i * kSides + k, q = i * kSides + (k + 1) % kSides;
      mesh.triangles.push_back({p, q, q + kSides});
      mesh.triangles.push_back({p, q + kSides, p + kSides});
    }
  }
  return mesh;
}

TEST(BladeModel, TheScalpelIsClosedAndOfTrueSize) {
  const BladeModel model = built_in_scalpel();
  check_blade_model(model);
  const Vec3f size = bounds(model.mesh).extent();
  EXPECT_NEAR(size.x, 0.16F, 0.002F);
  EXPECT_LT(size.z, 0.015F);
}

/// It is closed, its edge is at its surface, and it has the model's outline to rounding: it is as long and as
/// high, and thinner.
TEST(BladeModel, TheScalpelIsDrawnFlat) {
  BladeModel model = built_in_scalpel();
  const Box3f box = bounds(model.mesh), drawn = bounds(model.drawn);
  EXPECT_NEAR(drawn.extent().x, box.extent().x, 1e-4F);
  EXPECT_LE(drawn.extent().y, box.extent().y + 1e-5F);
  EXPECT_GE(drawn.extent().y, 0.9F * box.extent().y);
  EXPECT_LT(drawn.extent().z, 0.5F * box.extent().z);
  model.mesh = model.drawn;
  check_blade_model(model);
}

TEST(BladeModel, WhatIsWrongIsNamed) {
  const BladeModel good = built_in_scalpel();
  const auto expect = [](const BladeModel& model, const char* part) {
    const std::string message = test::message_of([&] { check_blade_model(model); });
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_NE(message.find("scalpel"), std::string::npos) << message;
  };
  BladeModel bad = good;
  bad.edge_m.clear();
  expect(bad, "has no edge");
  bad = good;
  bad.mesh.triangles.pop_back();
  expect(bad, "open edge");
  bad = good;
  for (Vec3f& p : bad.mesh.positions_m) p *= 1000.F;
  for (Vec3f& p : bad.edge_m) p *= 1000.F;
  expect(bad, "unit_m: 0.001");
  bad = good;
  for (Vec3f& p : bad.edge_m) p += Vec3f{0, 0.1F, 0};
  expect(bad, "from its mesh");
  bad = good;
  bad.edge_m[1].x = NAN;
  expect(bad, "not finite");
}

/// By the divergence theorem, half of the sum of p·n along the outline is the area of the picture. Its points
/// stand for a pixel each, so the sum is right to a few of hundreds.
TEST(Outline, EnclosesTheSilhouette) {
  const Room room;
  const BladeModel model = built_in_scalpel();
  const OutlineMesh mesh(model.mesh, "scalpel");
  std::mt19937 random(2);
  OutlineFinder finder;
  for (int k = 0; k < 10; ++k) {
    const Rigidd T = some_pose(random);
    const Camera& camera = room.rig.cameras[static_cast<std::size_t>(k % 8)];
    ASSERT_TRUE(finder.find(mesh, T, camera, 0.05, 4));
    double area = 0;
    const Pixel c = project(camera, T * mesh.center_m);
    for (const OutlinePoint& p : finder.points())
      area += 0.05 / 2 * ((p.px.x - c.u_px) * p.normal.x + (p.px.y - c.v_px) * p.normal.y);
    Camera fine = camera;  // 8 x 8 to a pixel
    fine.fx_px *= 8;
    fine.fy_px *= 8;
    fine.cx_px = 8 * camera.cx_px + 3.5;
    fine.cy_px = 8 * camera.cy_px + 3.5;
    fine.width_px *= 8;
    fine.height_px *= 8;
    const auto truth = static_cast<double>(render_silhouette(at_pose(model.mesh, T), fine).area_px()) / 64;
    EXPECT_NEAR(area, truth, 0.01 * truth) << k;
  }
}

/// Masks of 2.7 mm a pixel: 0.5 mm and 2 degrees. 95 % of errors within the stated two sigma.
TEST(PoseFit, ExactMasksGiveTheEdge) {
  const BladeModel model = built_in_scalpel();
  const OutlineMesh mesh(model.mesh, "scalpel");
  std::mt19937 random(3);
  std::normal_distribution<double> g;
  for (const bool full_hd : {false, true}) {
    const Room room({}, full_hd);
    Errors errors;
    for (int k = 0; k < (full_hd ? 8 : 30); ++k) {
      const Rigidd T = some_pose(random);
      Twist by;
      for (std::size_t i = 0; i < 6; ++i) by[i] = (i < 3 ? 0.05 : 0.004) * g(random);
      PoseFitter fitter(mesh, room.believed, {});
      const PoseFit fit = fitter.fit(room.see({at_pose(model.mesh, T)}), moved(T, mesh.center_m, by), 8);
      errors.add(fit.T_world_model, T, model);
      errors.add_stated(twist_between(T, fit.T_world_model, mesh.center_m), fit.covariance);
    }
    std::printf("  tip %.2f mm, roll %.2f degrees, %.3f within\n", errors.tip_mm(), errors.roll_deg(),
                errors.share_within());
    EXPECT_LT(errors.tip_mm(), full_hd ? 0.4 : 0.5);
    EXPECT_LT(errors.roll_deg(), full_hd ? 1 : 2);
    EXPECT_GE(errors.share_within(), 0.95);
  }
}

struct Followed {
  Errors errors;
  int frames = 0, known = 0, within = 0;
  int first_known = -1;
};

Followed follow(const Room& room, const BladeTrackerSettings& settings, int frames) {
  const BladeModel model = built_in_scalpel();
  std::mt19937 random(room.noise.seed);
  const Rigidd T0 = some_pose(random);
  BladeTracker tracker(model, room.believed, {0, 0.5, 0}, settings);
  Followed all;
  for (int k = 0; k < frames; ++k) {
    const Rigidd T = stroke(T0, k * kFrame_s);
    const TrackedBlade& now = tracker.update(room.see({at_pose(model.mesh, T)}, k), k > 0 ? kFrame_s : 0);
    ++all.frames;
    if (now.state != BladeState::known) continue;
    if (all.first_known < 0) all.first_known = k;
    ++all.known;
    if (k < 10) continue;
    all.errors.add(now.T_world_model, T, model);
    for (std::size_t i = 0; i < model.edge_m.size(); ++i) {
      const Vec3d off = vec_cast<double>(now.edge_m[i]) - T * vec_cast<double>(model.edge_m[i]);
      for (int axis = 0; axis < 3; ++axis) {
        ++all.errors.coordinates;
        all.errors.within += std::abs(off[axis]) <= now.two_sigma_m ? 1 : 0;
      }
    }
  }
  return all;
}

TEST(BladeTracker, FindsAndFollowsWithExactMasks) {
  const Followed all = follow(Room({.seed = 5}), {}, 30);
  EXPECT_LE(all.first_known, 6);  // which way round it is takes three frames, and three more to settle
  EXPECT_EQ(all.known, 30 - all.first_known);
  EXPECT_LT(all.errors.tip_mm(), 0.5);
  EXPECT_LT(all.errors.roll_deg(), 2);
  EXPECT_GE(all.errors.share_within(), 0.95);
}

/// Contours that a smooth field moves, 1 px (1 sigma) and alike within 8 px, and cameras that look 0.3 px
/// off. 95 % of errors within the stated two sigma. Long: twelve strokes. Errors of a stroke hang together,
/// so an RMS over twelve is known to a quarter of itself (two of its standard deviations, 1 / sqrt(2 12)
/// each, for three coordinates 1 / sqrt(2 36)): 1 mm and 3 degrees by 1.25.
TEST(BladeTracker, StatesWhatNoiseDoes) {
  Errors sum;
  int known = 0, frames = 0;
  for (const std::uint64_t seed : {4, 1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 12}) {
    if (seed != 4 && !is_long()) break;
    const Followed all =
        follow(Room({.calibration_px = 0.3, .segmentation_px = 1, .seed = seed}), {}, is_long() ? 60 : 24);
    sum.tip2 += all.errors.tip2;
    sum.roll2 += all.errors.roll2;
    sum.count += all.errors.count;
    sum.within += all.errors.within;
    sum.coordinates += all.errors.coordinates;
    known += all.known;
    frames += all.frames;
  }
  std::printf("  tip %.2f mm, roll %.1f degrees, %.3f within, %d of %d known\n", sum.tip_mm(), sum.roll_deg(),
              sum.share_within(), known, frames);
  EXPECT_GT(known, frames / 4);
  EXPECT_GE(sum.share_within(), 0.95);
  if (!is_long()) return;
  EXPECT_LT(sum.tip_mm(), 1.25);
  EXPECT_LT(sum.roll_deg(), 3.75);
}

TEST(BladeTracker, RefusesFourTimesTheNoise) {
  int known = 0, frames = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    if (seed > 1 && !is_long()) break;
    const Followed all =
        follow(Room({.calibration_px = 1.2, .segmentation_px = 4, .seed = seed}), {}, is_long() ? 30 : 8);
    known += all.known;
    frames += all.frames;
  }
  EXPECT_LE(known, frames / 100);
}

/// Pictures that stay the same to the bit say nothing new: the pose stays, and with it its error within the
/// stated two sigma. As if their errors were new in every frame, it drifted by a millimetre in two seconds.
TEST(BladeTracker, StaysWhereAStillToolIs) {
  const Room room;
  const BladeModel model = built_in_scalpel();
  BladeTracker tracker(model, room.rig.cameras, {0, 0.5, 0});
  const auto at = [](int k) { return Rigidd{Mat3d::identity(), {0.14, 0.49 - 0.1 * k / 30, 0}}; };
  constexpr int kMoves = 12;
  for (int k = 0; k < kMoves; ++k)
    tracker.update(room.see({at_pose(model.mesh, at(k))}), k > 0 ? kFrame_s : 0);
  ASSERT_EQ(tracker.now().state, BladeState::known);
  const Rigidd T = at(kMoves - 1), before = tracker.now().T_world_model;
  const std::vector<BitMask> still = room.see({at_pose(model.mesh, T)});
  for (int k = 0; k < 60; ++k) tracker.update(still, kFrame_s);
  EXPECT_EQ(tracker.now().state, BladeState::known);
  EXPECT_EQ(tracker.now().T_world_model.t, before.t);
  const Vec3d tip = vec_cast<double>(model.edge_m[0]);
  EXPECT_LT(length(tracker.now().T_world_model * tip - T * tip), tracker.now().two_sigma_m);
  tracker.update(room.see({at_pose(model.mesh, at(kMoves))}), kFrame_s);
  EXPECT_EQ(tracker.now().state, BladeState::known);  // it goes on
}

TEST(BladeTracker, LeavesAndReturns) {
  const Room room;
  const BladeModel model = built_in_scalpel();
  std::mt19937 random(9);
  const Rigidd T = some_pose(random);
  BladeTracker tracker(model, room.believed, {0, 0.5, 0});
  Rigidd elsewhere = T;
  elsewhere.t += Vec3d{0.1, 0.05, -0.1};
  const auto seen = room.see({at_pose(model.mesh, T)}), nothing = room.see({}),
             again = room.see({at_pose(model.mesh, elsewhere)});
  std::vector<BladeState> states;
  for (int k = 0; k < 22; ++k)
    states.push_back(tracker.update(k < 6 ? seen : k < 14 ? nothing : again, k > 0 ? kFrame_s : 0).state);
  EXPECT_EQ(states[5], BladeState::known);
  for (std::size_t k = 6; k < 16; ++k) EXPECT_NE(states[k], BladeState::known) << k;
  EXPECT_EQ(states[13], BladeState::absent);
  EXPECT_EQ(states[21], BladeState::known);
  Errors errors;
  errors.add(tracker.now().T_world_model, elsewhere, model);
  EXPECT_LT(errors.tip_mm(), 1);
}

/// 20 cm from one frame to the next are 6 m/s.
TEST(BladeTracker, AJumpIsNoMotion) {
  const Room room;
  const BladeModel model = built_in_scalpel();
  std::mt19937 random(10);
  const Rigidd T = some_pose(random);
  BladeTrackerSettings settings;
  settings.most_m_s = 0.05;  // what is followed moves faster
  BladeTracker tracker(model, room.believed, {0, 0.5, 0}, settings);
  int jumps = 0;
  for (int k = 0; k < 12; ++k) {
    const Rigidd now = stroke(T, k < 6 ? 0 : (k - 5) * 2 * kFrame_s);
    jumps += tracker.update(room.see({at_pose(model.mesh, now)}), k > 0 ? kFrame_s : 0).state ==
             BladeState::jumped;
  }
  EXPECT_GE(jumps, 4);
}

/// Of a tool nothing is left, of a fist nearly all.
TEST(BladeTracker, TakesItselfOutOfMasks) {
  const Room room;
  const BladeModel model = built_in_scalpel();
  std::mt19937 random(11);
  const Rigidd T = some_pose(random);
  const TriangleMesh fist = ball(T * Vec3d{0.05, 0, 0}, 0.035);
  const auto both = room.see({at_pose(model.mesh, T), fist}), hand = room.see({fist});
  BladeTracker tracker(model, room.believed, {0, 0.5, 0});
  tracker.update(both, 0);
  auto left = both;
  tracker.take_from(left);
  for (std::size_t c = 0; c < left.size(); ++c) {
    std::int64_t beside = 0, lost = 0;
    for (std::size_t i = 0; i < left[c].words.size(); ++i) {
      beside += __builtin_popcount(left[c].words[i] & ~hand[c].words[i]);
      lost += __builtin_popcount(hand[c].words[i] & ~left[c].words[i]);
    }
    EXPECT_LT(beside, 25) << c;  // where it enters the fist
    EXPECT_LT(lost, hand[c].area_px() / 50) << c;
  }
}

/// A rod of 6 cm is thin, too.
TEST(BladeTracker, AShortRodIsNoScalpel) {
  const Room room;
  TriangleMesh rod = ball({}, 0.005);
  for (Vec3f& p : rod.positions_m) p = Vec3f{6 * p.x, p.y + 0.5F, p.z};
  const auto masks = room.see({rod});
  BladeTracker tracker(built_in_scalpel(), room.believed, {0, 0.5, 0});
  for (int k = 0; k < 12; ++k)
    EXPECT_EQ(tracker.update(masks, k > 0 ? kFrame_s : 0).state, BladeState::absent) << k;
}

/// Spindles of the scalpel's length, 6 and 9 mm thick: without its step from the handle to the blade.
TEST(BladeTracker, APenIsNoScalpel) {
  const Room room;
  for (const double radius_m : {0.003, 0.0045}) {
    TriangleMesh pen = ball({}, radius_m);
    for (Vec3f& p : pen.positions_m) p = Vec3f{p.x * static_cast<float>(0.08 / radius_m), p.y + 0.5F, p.z};
    const auto masks = room.see({pen});
    BladeTracker tracker(built_in_scalpel(), room.believed, {0, 0.5, 0});
    for (int k = 0; k < 12; ++k) {
      const TrackedBlade& now = tracker.update(masks, k > 0 ? kFrame_s : 0);
      EXPECT_NE(now.state, BladeState::known) << k << " of " << radius_m;
    }
  }
}

/// Half of the handle is in a fist.
TEST(BladeTracker, AHandHoldsIt) {
  const Room room;
  const BladeModel model = built_in_scalpel();
  std::mt19937 random(11);
  for (int k = 0; k < 4; ++k) {
    const Rigidd T = some_pose(random);
    const TriangleMesh fist = ball(T * Vec3d{0.05, 0, 0}, 0.035);
    BladeTracker tracker(model, room.believed, {0, 0.5, 0});
    for (int frame = 0; frame < 6; ++frame)
      tracker.update(room.see({at_pose(model.mesh, T), fist}), frame > 0 ? kFrame_s : 0);
    EXPECT_EQ(tracker.now().state, BladeState::known) << k;
    Errors errors;
    errors.add(tracker.now().T_world_model, T, model);
    EXPECT_LT(errors.tip_mm(), 1.5) << k;
    EXPECT_LT(errors.roll_deg(), 4) << k;
  }
}

TEST(BladeTracker, TwoToolsAreTwo) {
  const Room room;
  const BladeModel model = built_in_scalpel();
  std::mt19937 random(12);
  Rigidd a = some_pose(random), b = some_pose(random);
  b.t = a.t + Vec3d{0.02, 0.15, 0.1};
  BladeTrackerSettings settings;
  settings.equal_tools = 2;
  BladeTracker first(model, room.believed, {0, 0.5, 0}, settings),
      second(model, room.believed, {0, 0.5, 0}, settings);
  const auto masks = room.see({at_pose(model.mesh, a), at_pose(model.mesh, b)});
  for (int k = 0; k < 6; ++k) {
    const double dt_s = k > 0 ? kFrame_s : 0;
    first.update(masks, dt_s);
    std::vector<BitMask> taken;
    for (const BitMask& mask : masks) taken.emplace_back(mask.width_px, mask.height_px);
    first.add_to(taken);
    second.update(masks, dt_s, taken);
  }
  ASSERT_EQ(first.now().state, BladeState::known);
  ASSERT_EQ(second.now().state, BladeState::known);
  const bool swapped = length(first.now().T_world_model.t - a.t) > 0.05;
  Errors errors;
  errors.add(first.now().T_world_model, swapped ? b : a, model);
  errors.add(second.now().T_world_model, swapped ? a : b, model);
  EXPECT_LT(errors.tip_mm(), 1);
}

}  // namespace
}  // namespace tactus
