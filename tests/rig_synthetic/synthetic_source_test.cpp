#include "tactus/rig/synthetic/synthetic_source.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/message_of.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

using test::message_of;

TEST(SyntheticRig, EveryCameraSeesTheMiddleAndMostOfTheCube) {
  const Rig rig = make_synthetic_rig();
  ASSERT_EQ(rig.cameras.size(), 8U);
  ASSERT_EQ(rig.depth_cameras.size(), 1U);
  EXPECT_EQ(rig.depth_cameras[0].width_px, 200);
  for (const Camera& camera : rig.cameras) {
    check_camera(camera);
    EXPECT_EQ(camera.width_px, 640);
    EXPECT_EQ(camera.height_px, 480);
    const Pixel middle = project(camera, {0, 0.5, 0});
    EXPECT_NEAR(middle.u_px, 319.5, 1e-6);
    EXPECT_NEAR(middle.v_px, 239.5, 1e-6);
    int seen = 0, points = 0;
    for (double x = -0.475; x < 0.5; x += 0.05)
      for (double y = 0.025; y < 1; y += 0.05)
        for (double z = -0.475; z < 0.5; z += 0.05) {
          const Pixel p = project(camera, {x, y, z});
          ++points;
          seen += p.z_m > 0 && p.u_px > -0.5 && p.u_px < 639.5 && p.v_px > -0.5 && p.v_px < 479.5;
        }
    EXPECT_GT(seen, 0.9 * points) << camera.name;
  }
}

TEST(SyntheticSource, BeginsWhereItIsToldAndCountsFromThere) {
  SyntheticSource source({.figure = "sphere", .fps = 25, .first_frame = 5, .frames = 2, .truth = false});
  EXPECT_EQ(source.frame_count(), 2);
  EXPECT_EQ(source.fps(), 25);
  FrameSet frame;
  for (const int tick : {5, 6}) {
    ASSERT_EQ(source.next(frame), NextFrame::success);
    EXPECT_EQ(frame.tick, tick);
    EXPECT_DOUBLE_EQ(frame.time_s, tick / 25.0);
  }
  EXPECT_EQ(source.next(frame), NextFrame::no_more_data);
}

TEST(SyntheticSource, FillsAFrameWithTheSizesOfItsRig) {
  SyntheticSource source({.figure = "rabbit", .frames = 2});
  EXPECT_EQ(source.frame_count(), 2);
  FrameSet frame;
  ASSERT_EQ(source.next(frame), NextFrame::success);
  ASSERT_EQ(frame.silhouettes.size(), 8U);
  double mean = 0;
  for (const BitMask& mask : frame.silhouettes) {
    mean += static_cast<double>(mask.area_px()) / (640 * 480) / 8;
    EXPECT_EQ(mask.words.size(), 480U * 20);
  }
  EXPECT_GT(mean, 0.08);  // what the benchmarks are compared at: 8-11 % of the image
  EXPECT_LT(mean, 0.11);
  ASSERT_EQ(frame.depths_m.size(), 1U);
  EXPECT_EQ(frame.depths_m[0].width_px, 200);
  EXPECT_TRUE(frame.colors.empty());
  ASSERT_TRUE(frame.truth_volume_m3.has_value());
  EXPECT_NEAR(*frame.truth_volume_m3, 0.045, 0.005);
  EXPECT_EQ(source.status(), "");
  EXPECT_EQ(frame.tick, 0);
  ASSERT_EQ(source.next(frame), NextFrame::success);
  EXPECT_EQ(frame.tick, 1);
  EXPECT_DOUBLE_EQ(frame.time_s, 1.0 / 30);
  EXPECT_EQ(source.next(frame), NextFrame::no_more_data);
}

TEST(SyntheticSource, GivesTheSameFramesAgain) {
  SyntheticOptions options{.figure = "hand-moving", .colors = true};
  options.rig.camera_count = 3;
  SyntheticSource one(options), two(options);
  EXPECT_TRUE(one.figure().moving());
  FrameSet a, b, first;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(one.next(a), NextFrame::success);
    ASSERT_EQ(two.next(b), NextFrame::success);
    EXPECT_EQ(a.silhouettes, b.silhouettes);
    EXPECT_EQ(a.depths_m.at(0).pixels, b.depths_m.at(0).pixels);
    EXPECT_EQ(a.truth_volume_m3, b.truth_volume_m3);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(a.colors[c].pixels, b.colors[c].pixels);
    if (i == 0) first = a;
  }
  EXPECT_NE(a.silhouettes, first.silhouettes);
  one.seek(0);
  one.next(a);
  EXPECT_EQ(a.silhouettes, first.silhouettes);
}

TEST(SyntheticSource, ColoursChangeNoSilhouette) {
  SyntheticOptions options{.figure = "rabbit", .truth = false};
  FrameSet plain, coloured;
  SyntheticSource(options).next(plain);
  options.colors = true;
  SyntheticSource(options).next(coloured);
  EXPECT_EQ(plain.silhouettes, coloured.silhouettes);
  ASSERT_EQ(coloured.colors.size(), 8U);
  // The wall is grey and the figure is not.
  const ColorImage& image = coloured.colors.front();
  for (Index y = 0; y < 480; y += 7)
    for (Index x = 0; x < 640; x += 7) {
      const Rgb8 c = image(x, y);
      ASSERT_EQ(c.r > c.g, coloured.silhouettes.front()(x, y));
    }
}

TEST(SyntheticSource, LeavesOutWhatIsNotAskedFor) {
  SyntheticSource source({.figure = "sphere", .depth = false, .truth = false});
  EXPECT_TRUE(source.rig().depth_cameras.empty());
  FrameSet frame;
  frame.truth_volume_m3 = 1;  // of an older frame
  source.next(frame);
  EXPECT_TRUE(frame.depths_m.empty());
  EXPECT_FALSE(frame.truth_volume_m3.has_value());
}

/// Three depth cameras a third of a turn apart: what each measures lies on the figure.
TEST(SyntheticSource, ManyDepthCamerasSeeTheFigureFromAllAround) {
  SyntheticOptions options{.figure = "rabbit-still", .truth = false};
  options.rig.depth_cameras = 3;
  SyntheticSource source(options);
  FrameSet frame;
  ASSERT_EQ(source.next(frame), NextFrame::success);
  ASSERT_EQ(source.rig().depth_cameras.size(), 3U);
  ASSERT_EQ(frame.depths_m.size(), 3U);
  EXPECT_EQ(source.rig().depth_cameras[2].name, "tof3");
  const FigureShape shape = source.figure().at(0);
  for (std::size_t d = 0; d < 3; ++d) {
    const Camera& camera = source.rig().depth_cameras[d];
    int measured = 0;
    for (Index y = 0; y < camera.height_px; ++y) {
      for (Index x = 0; x < camera.width_px; ++x) {
        const auto e = static_cast<double>(frame.depths_m[d](x, y));
        if (e == 0) continue;
        ++measured;
        const Vec3d p = camera.center_world() + e * pixel_ray_world(camera, x, y);
        // The tracer stops 2e-6 m off the figure; float32 at 2 m adds 2e-7 m.
        EXPECT_NEAR(shape.distance_m(vec_cast<float>(p)), 0, 1e-5F);
      }
    }
    EXPECT_GT(measured, 1000) << camera.name;
  }
}

TEST(SyntheticSource, SaysWhenACameraSeesNothing) {
  SyntheticOptions options{.figure = "sphere"};
  options.shape.offset_m = {0, 5, 0};
  SyntheticSource source(options);
  FrameSet frame;
  EXPECT_EQ(source.next(frame), NextFrame::success);
  EXPECT_EQ(source.status(), "camera 'cam0' sees nothing of figure 'sphere'");
  EXPECT_EQ(frame.silhouettes.front().area_px(), 0);
}

TEST(SyntheticSource, RefusesBadOptions) {
  const auto message = [](const auto& change) -> std::string {
    SyntheticOptions options;
    change(options);
    return message_of([&] { SyntheticSource source(options); }, ErrorKind::usage);
  };
  EXPECT_EQ(message([](auto& o) { o.figure = "hnad"; }), "unknown figure 'hnad'; did you mean 'hand'?");
  EXPECT_NE(message([](auto& o) { o.fps = 0; }).find("fps is 0"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.fps = NAN; }).find("fps is nan"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.frames = 0; }).find("frames is 0"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.rig.camera_count = 0; }).find("camera_count is 0, expected 1 to 64"),
            std::string::npos);
  EXPECT_NE(message([](auto& o) { o.rig.width_px = -5; }).find("width_px is -5"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.rig.focal_px = 0; }).find("focal_px is 0"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.rig.ring_radius_m = 0.1; }).find("ring_radius_m is 0.1"),
            std::string::npos);
  EXPECT_NE(message([](auto& o) { o.shape.scale = 8; }).find("with scale 8 reaches a camera"),
            std::string::npos);
  EXPECT_NE(message([](auto& o) { o.shape.scale = -1; }).find("scale -1"), std::string::npos);
}

}  // namespace
}  // namespace tactus
