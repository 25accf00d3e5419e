// What a hull says about its rig: too much, too little, in which view; and space that too few cameras see.
#include "tactus/reconstruct/hull_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "reconstruct/sphere_scene.h"
#include "support/device_sets.h"
#include "support/masks.h"
#include "support/message_of.h"
#include "support/synthetic_frame.h"
#include "tactus/geom/image/mask_bounds.h"
#include "tactus/reconstruct/doctor/workspace_from_cones.h"

namespace tactus {
namespace {

using test::kCube;

struct Checked {
  HullQuality quality;
  std::vector<HullFinding> found;
};

Checked check(const std::vector<Camera>& cameras, const std::vector<BitMask>& masks,
              const Box3f& workspace_m = kCube, const std::string& devices = "cpu", Index min_views = 2) {
  DeviceSet set(devices, 3);
  VisualHull hull(set, cameras, {.workspace_m = workspace_m, .resolution = 64, .min_views = min_views});
  HullCheck hull_check(set.context(0), cameras, workspace_m, hull.voxel_size_m());
  hull.upload(masks);
  hull.reconstruct();
  hull_check.submit(set.context(0), hull.mesh(), masks);
  Checked result{hull_check.quality(set.context(0)), {}};
  result.found = hull_check.news(set.context(0));
  EXPECT_TRUE(hull_check.news(set.context(0)).empty()) << "a fault is told once";
  return result;
}

bool names(const Checked& checked, HullFault fault, int camera = -1) {
  return std::any_of(checked.found.begin(), checked.found.end(),
                     [&](const HullFinding& f) { return f.fault == fault && f.camera == camera; });
}

/// Masks of a sphere, and one more disc of its own size beside it in one view: half of that mask is covered.
std::vector<BitMask> with_twin(const std::vector<Camera>& cameras, std::size_t view) {
  std::vector<BitMask> masks = test::sphere_silhouettes(cameras, {0, 0.5, 0}, 0.2);
  const BitMask beside = masks[view];
  constexpr Index kShift = 64;  // eight tiles: the discs are 63 px wide
  for (Index y = 0; y < beside.height_px; ++y) {
    for (Index x = 0; x + kShift < beside.width_px; ++x) {
      if (beside(x, y)) masks[view].set(x + kShift, y);
    }
  }
  return masks;
}

class HullCheckOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(HullCheckOn);

TEST_P(HullCheckOn, FiguresAreWellAndMeasureTheSame) {
  for (const char* figure : {"hand-still", "rabbit-still", "scalpel-still", "bowl-still"}) {
    const test::SyntheticFrame seen = test::silhouettes_of(figure);
    const Checked here = check(seen.rig.cameras, seen.frame.silhouettes, seen.rig.workspace_m, GetParam()),
                  cpu = check(seen.rig.cameras, seen.frame.silhouettes, seen.rig.workspace_m);
    EXPECT_EQ(findings_text(here.found), "") << figure;
    ASSERT_EQ(here.quality.views.size(), 8U);
    for (std::size_t c = 0; c < 8; ++c) {
      EXPECT_EQ(here.quality.views[c].recall, cpu.quality.views[c].recall);
      // Tiles are set at their quarter points, so the surface crosses every one of them.
      EXPECT_GE(here.quality.views[c].recall, 0.95) << figure << " " << c;
    }
  }
}

TEST_P(HullCheckOn, RecallIsTheShareOfTheTilesThatAreCovered) {
  const std::vector<Camera> cameras = test::ring(8);
  const std::vector<BitMask> masks = with_twin(cameras, 3);
  const Checked checked = check(cameras, masks, kCube, GetParam());
  // The discs lie on the tiles alike; a row of them may reach beyond the image of the workspace: 10 %.
  EXPECT_NEAR(checked.quality.views[3].recall, 0.5, 0.05);
  EXPECT_TRUE(names(checked, HullFault::view_differs, 3)) << findings_text(checked.found);
  EXPECT_EQ(checked.found.size(), 1U) << findings_text(checked.found);
}

/// After the first frame, what needs the host is looked at beside the frames that follow. A run that ends
/// before is told at its end.
TEST(HullCheck, ADoubtIsAnsweredEightFramesLater) {
  const std::vector<Camera> cameras = test::ring(8);
  const std::vector<BitMask> well = test::sphere_silhouettes(cameras, {0, 0.5, 0}, 0.2),
                             wrong = with_twin(cameras, 3);
  DeviceSet set("cpu", 3);
  VisualHull hull(set, cameras, {.workspace_m = kCube, .resolution = 64});
  for (const int frames : {4, 20}) {
    HullCheck check(set.context(0), cameras, kCube, hull.voxel_size_m());
    for (int frame = 0; frame < frames; ++frame) {
      const std::vector<BitMask>& masks = frame == 1 ? wrong : well;
      hull.upload(masks);
      hull.reconstruct();
      check.submit(set.context(0), hull.mesh(), masks);
      const std::vector<HullFinding> found = check.news(set.context(0));
      ASSERT_EQ(found.size(), frame == 9 ? 1U : 0U) << frame << ": " << findings_text(found);
      if (frame == 9) {
        EXPECT_EQ(found[0].camera, 3);
      }
    }
    const std::vector<HullFinding> last = check.last_news();
    ASSERT_EQ(last.size(), frames == 4 ? 1U : 0U) << findings_text(last);
    if (frames == 4) {
      EXPECT_EQ(last[0].camera, 3);
    }
    EXPECT_TRUE(check.last_news().empty());
  }
}

/// Two cameras whose lines of sight are an angle apart bound their bisector worst, by the sine of its half; a
/// sphere of radius r reaches about r / sine to either side of the middle. Three around bound all directions.
TEST(HullCheck, TwoCamerasAreSaidToBoundBadly) {
  const auto around = [](std::vector<double> angles_deg) {
    std::vector<Camera> cameras;
    for (const double a : angles_deg) {
      const double angle = a * std::numbers::pi / 180;
      cameras.push_back(
          look_at({3 * std::cos(angle), 0.5, 3 * std::sin(angle)}, {0, 0.5, 0}, {0, 1, 0}, 320, 240, 600));
      cameras.back().name = std::to_string(cameras.size());
    }
    return cameras;
  };
  const std::vector<Vec3f> points{{-0.1F, 0.5F, 0}, {0.1F, 0.5F, 0}, {0, 0.4F, 0}, {0, 0.6F, 0}};
  for (const double angle : {60.0, 90.0, 170.0}) {
    const WeakDirection weak = weak_direction(around({0, angle}), points);
    const double acute = std::min(angle, 180 - angle);
    EXPECT_NEAR(weak.sine, std::sin(acute / 2 * std::numbers::pi / 180), 0.04) << angle;  // 3 degrees apart
  }
  EXPECT_NEAR(weak_direction(around({0}), points).extent_m, 0.2, 1e-6);
  const std::vector<Camera> two = around({0, 90}), three = around({0, 120, 240}),
                            narrow = around({0, 10, 25});
  const auto reported = [](const std::vector<Camera>& cameras) {
    return check(cameras, test::sphere_silhouettes(cameras, {0, 0.5, 0}, 0.2)).found;
  };
  for (const std::vector<Camera>& few : {around({0}), two, narrow}) {
    const std::vector<HullFinding> found = reported(few);
    ASSERT_EQ(found.size(), 1U) << findings_text(found);
    EXPECT_EQ(found[0].fault, HullFault::bounded_badly);
    EXPECT_FALSE(found[0].is_fatal);
  }
  EXPECT_TRUE(reported(three).empty()) << findings_text(reported(three));
}

/// A rod that is taken out of the masks leaves no hull, or a strip of a pixel: the rig is still right.
TEST(HullCheck, WhatIsTakenOutOfMasksIsNoFaultOfTheRig) {
  const std::vector<Camera> cameras = test::ring(6);
  const std::vector<BitMask> masks = test::sphere_silhouettes(cameras, {0, 0.5, 0}, 0.1);
  std::vector<BitMask> strips = masks;
  for (BitMask& strip : strips) {
    const PixelRect rect = bounds_of(strip);
    for (Index y = rect.min_y; y <= rect.max_y; ++y)
      for (Index x = rect.min_x; x < rect.max_x; ++x) strip.clear(x, y);
  }
  DeviceSet set("cpu", 3);
  VisualHull hull(set, cameras, {.workspace_m = kCube, .resolution = 64});
  const auto found = [&](std::vector<Camera> seen_by, const std::vector<BitMask>& carved) {
    HullCheck check(set.context(0), seen_by, kCube, hull.voxel_size_m());
    hull.upload(carved);
    hull.reconstruct();
    check.prepare(masks, carved);
    check.measure(set.context(0), hull.mesh());
    return check.news(set.context(0));
  };
  EXPECT_TRUE(any_fatal(found(cameras, strips)) == false && found(cameras, strips).empty())
      << findings_text(found(cameras, strips));
  // A rig that is wrong still is: poses are off by more than the sphere is large.
  std::vector<Camera> wrong = cameras;
  for (std::size_t c = 0; c < wrong.size(); ++c) wrong[c].T_cam_world.t.y += c % 2 == 0 ? 0.3 : -0.3;
  EXPECT_TRUE(any_fatal(found(wrong, strips)));
}

TEST(HullCheck, EmptyWorkspaceCutsAndFillsAreNamed) {
  const std::vector<Camera> cameras = test::ring(8);
  const std::vector<BitMask> masks = test::sphere_silhouettes(cameras, {0, 0.5, 0}, 0.2);
  // Millimetres for metres: the cones do not meet near the cube.
  std::vector<Camera> far = cameras;
  for (Camera& c : far) c.T_cam_world.t = 1000.0 * c.T_cam_world.t;
  EXPECT_TRUE(any_fatal(check(far, masks).found));
  // A workspace within the sphere is filled; one that holds half of it is cut.
  const Checked filled = check(cameras, masks, {{-0.1F, 0.4F, -0.1F}, {0.1F, 0.6F, 0.1F}});
  EXPECT_TRUE(names(filled, HullFault::fills_workspace)) << findings_text(filled.found);
  EXPECT_TRUE(any_fatal(filled.found));
  const Checked cut = check(cameras, masks, {{-0.5F, 0.5F, -0.5F}, {0.5F, 1, 0.5F}});
  EXPECT_TRUE(names(cut, HullFault::cut_by_workspace)) << findings_text(cut.found);
  EXPECT_FALSE(any_fatal(cut.found));
  // Nobody is there: nothing to say.
  const std::vector<BitMask> nobody(cameras.size(), BitMask(320, 240));
  EXPECT_EQ(findings_text(check(cameras, nobody).found), "");
}

TEST(HullCheck, InvertedPosesLeaveNothing) {
  // Poses the wrong way round see the workspace from behind, and what no camera sees is outside.
  std::vector<Camera> cameras = test::ring(8);
  const std::vector<BitMask> masks = test::sphere_silhouettes(cameras, {0, 0.5, 0}, 0.2);
  for (Camera& c : cameras) c.T_cam_world = inverse(c.T_cam_world);
  const Checked checked = check(cameras, masks);
  EXPECT_TRUE(any_fatal(checked.found)) << findings_text(checked.found);
  EXPECT_NE(findings_text(checked.found).find("tactus doctor"), std::string::npos);
}

/// Two spheres; the second stands where few cameras look. Independent count: voxel centres against the rule.
TEST_P(HullCheckOn, SpaceThatFewCamerasSeeIsOutside) {
  std::vector<Camera> cameras = test::ring(8);
  for (std::size_t c = 2; c < 8; ++c)
    cameras[c] = look_at(cameras[c].center_world(), {0, 0.5, 0}, {0, 1, 0}, 160, 120, 288);
  for (std::size_t c = 0; c < 8; ++c) cameras[c].name = "cam" + std::to_string(c);
  const std::vector<BitMask> all_set = [&] {
    std::vector<BitMask> masks;
    for (const Camera& c : cameras)
      masks.push_back(test::make_mask(c.width_px, c.height_px, [](Index, Index) { return true; }));
    return masks;
  }();
  constexpr Index n = 96;
  for (const Index least : {0, 1, 3, 7}) {
    DeviceSet set(GetParam(), 7);
    VisualHull hull(set, cameras, {.workspace_m = kCube, .resolution = n, .min_views = least});
    hull.upload(all_set);
    hull.reconstruct();
    EXPECT_FALSE(hull.report().overflow.has_value());
    const TriangleMesh mesh = hull.download();
    EXPECT_TRUE(topology(mesh).closed_manifold()) << least;
    double inside = 0;
    for (Index k = 0; k < n * n * n; ++k) {
      const Vec3d p{(k % n + 0.5) / n - 0.5, (k / n % n + 0.5) / n, (k / n / n + 0.5) / n - 0.5};
      Index views = 0;
      for (const Camera& c : cameras) {
        const Pixel px = project(c, p);
        views += px.z_m > 0 && px.u_px >= -0.5 && px.v_px >= -0.5 && px.u_px <= c.width_px - 0.5 &&
                         px.v_px <= c.height_px - 0.5
                     ? 1
                     : 0;
      }
      inside += views >= least ? 1.0 / (n * n * n) : 0;
    }
    // The cut runs through nodes, not between them: up to a voxel too far out all over, on a surface of at
    // most 6: half of that on average, 6 * 0.5 / 96.
    EXPECT_NEAR(volume_m3(mesh), inside, 0.04) << least;
    if (GetParam() == "cpu") continue;
    DeviceSet one("cpu");
    VisualHull expected(one, cameras, {.workspace_m = kCube, .resolution = n, .min_views = least});
    expected.upload(all_set);
    expected.reconstruct();
    const TriangleMesh same = expected.download();
    EXPECT_EQ(mesh.positions_m, same.positions_m);
    EXPECT_EQ(mesh.triangles, same.triangles);
  }
}

TEST(HullCheck, APieceThatFewCamerasSeeIsNamed) {
  // Two cameras have a wide lens and see a second ball, which the others leave out of their images.
  std::vector<Camera> cameras = test::ring(8);
  for (std::size_t c = 0; c < 8; ++c) {
    const bool wide = c < 2;
    cameras[c] = look_at(cameras[c].center_world(), {0, 0.5, 0}, {0, 1, 0}, 320, 240, wide ? 250 : 900);
    cameras[c].name = "cam" + std::to_string(c);
  }
  const Vec3d beside{0, 0.9, 0};  // narrow images end 0.25 m above the middle
  std::vector<BitMask> masks = test::sphere_silhouettes(cameras, {0, 0.5, 0}, 0.1);
  for (std::size_t c = 0; c < 8; ++c) {
    const BitMask other = test::sphere_silhouette(cameras[c], beside, 0.08);
    for (std::size_t w = 0; w < other.words.size(); ++w) masks[c].words[w] |= other.words[w];
  }
  const Checked checked = check(cameras, masks);
  EXPECT_TRUE(names(checked, HullFault::body_seen_by_few)) << findings_text(checked.found);
  // With as many views as see the first ball the second is gone.
  const Checked cured = check(cameras, masks, kCube, "cpu", 6);
  EXPECT_FALSE(names(cured, HullFault::body_seen_by_few)) << findings_text(cured.found);
}

TEST(HullCheck, MinViewsOutOfRangeIsNamed) {
  DeviceSet set("cpu");
  const std::vector<Camera> cameras = test::ring(3);
  EXPECT_EQ(test::message_of([&] { VisualHull(set, cameras, {.workspace_m = kCube, .min_views = 65}); },
                             ErrorKind::usage),
            "min_views 65: expected 0 to 64");
}

/// A point of a mask that is too small or too large carves, or covers nothing: the verdict separates them.
TEST(Judge, ALeakAndAHoleAreNamedApart) {
  const std::vector<Camera> cameras = test::ring(5);
  HullQuality q{1000, true, 0, {}};
  for (int c = 0; c < 5; ++c) q.views.push_back({true, 0.98, 0.97});
  EXPECT_TRUE(judge_hull(cameras, q, kCube).empty());
  q.views[2] = {true, 0.8, 0.8};
  EXPECT_NE(findings_text(judge_hull(cameras, q, kCube))
                .find("camera 'cam2': the hull covers 80 % of its mask (IoU 0.80)"),
            std::string::npos);
  EXPECT_NE(findings_text(judge_hull(cameras, q, kCube)).find("too large"), std::string::npos);
  q.views[2] = {true, 0.98, 0.8};
  EXPECT_NE(findings_text(judge_hull(cameras, q, kCube)).find("a hole"), std::string::npos);
  for (ViewQuality& v : q.views) v.recall = v.iou = 0.4;
  EXPECT_TRUE(any_fatal(judge_hull(cameras, q, kCube)));
}

TEST(Judge, ViewsThatLookElsewhereShowMoreOrContradictAreNamed) {
  const std::vector<Camera> cameras = test::ring(5);
  HullQuality right{1000, true, 0, {}};
  for (int c = 0; c < 5; ++c) right.views.push_back({true, 0.98, 0.97});
  const auto reported = [&](const HullQuality& q) { return findings_text(judge_hull(cameras, q, kCube)); };
  HullQuality q = right;
  q.views[3] = {.is_used = false, .looks_elsewhere = true};
  EXPECT_NE(reported(q).find("camera 'cam3' shows something, but does not look at the workspace"),
            std::string::npos);
  for (const std::size_t c : {0U, 1U}) q.views[c] = q.views[3];
  EXPECT_TRUE(any_fatal(judge_hull(cameras, q, kCube)));
  EXPECT_NE(reported(q).find("3 of 5 cameras show something"), std::string::npos) << reported(q);
  q = right;
  q.views[1].outside = 0.2;
  EXPECT_NE(reported(q).find("camera 'cam1': 20 % of its mask lie outside the image of the workspace"),
            std::string::npos);
  // A workspace that cuts the object shows as much in all masks.
  for (ViewQuality& v : q.views) v.outside = 0.2;
  EXPECT_EQ(reported(q), "");
  q = right;
  for (ViewQuality& v : q.views) v.recall = v.iou = 0.88;
  EXPECT_NE(reported(q).find("the hull covers 88 % of the masks, the mean of all views"), std::string::npos);
  // A grid that is too coarse for the object loses as much.
  for (ViewQuality& v : q.views) v.too_thin = 0.1;
  EXPECT_EQ(reported(q), "");
}

TEST(WorkspaceFromCones, HoldsTheSphereAndLittleMore) {
  const std::vector<Camera> cameras = test::ring(8);
  const Vec3d center{0.7, -0.4, 1.1};
  std::vector<Camera> moved = cameras;  // the rig stands elsewhere
  for (Camera& c : moved) c.T_cam_world.t = c.T_cam_world.t - c.T_cam_world.R * (center - Vec3d{0, 0.5, 0});
  const std::optional<ConeBox> box =
      workspace_from_cones(moved, test::sphere_silhouettes(moved, center, 0.2));
  ASSERT_TRUE(box.has_value());
  EXPECT_TRUE(box->is_bounded);
  for (int i = 0; i < 3; ++i) {
    const double low = center[i] - static_cast<double>(box->box_m.min[i]),
                 high = static_cast<double>(box->box_m.max[i]) - center[i];
    // The hull of 8 cones stands off the sphere by up to a fifth, more above and below, where no camera looks
    // from; two samples of 1/48 on either side.
    EXPECT_GT(std::min(low, high), 0.2);
    EXPECT_LT(std::max(low, high), 0.2 * 1.6);
  }
}

TEST(WorkspaceFromCones, ConesThatDoNotMeetAndThoseLeftOpen) {
  std::vector<Camera> cameras = test::ring(4);
  const std::vector<BitMask> masks = test::sphere_silhouettes(cameras, {0, 0.5, 0}, 0.1);
  std::vector<Camera> apart = cameras;
  apart[1].T_cam_world.t.x += 3;
  EXPECT_FALSE(workspace_from_cones(apart, masks).has_value());
  const std::span<const Camera> one(cameras.data(), 1);
  const std::optional<ConeBox> open = workspace_from_cones(one, std::span(masks).first(1));
  ASSERT_TRUE(open.has_value());
  EXPECT_FALSE(open->is_bounded);
  EXPECT_FALSE(workspace_from_cones(cameras, std::vector<BitMask>(4, BitMask(320, 240))).has_value());
}

TEST(MaskBounds, AreThoseOfThePixels) {
  BitMask mask(100, 50);
  EXPECT_TRUE(bounds_of(mask).empty());
  mask.set(33, 7);
  mask.set(99, 40);
  mask.set(64, 20);
  const PixelRect r = bounds_of(mask);
  EXPECT_EQ(r.min_x, 33);
  EXPECT_EQ(r.max_x, 99);
  EXPECT_EQ(r.min_y, 7);
  EXPECT_EQ(r.max_y, 40);
}

}  // namespace
}  // namespace tactus
