/// What depth cameras add to the pose of a tool.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tactus/track/depth_rays.h"
#include "track/track_scene.h"

namespace tactus {
namespace {

constexpr double kDepth_m = 0.005;

/// The figure from which the model was made, seen by two depth cameras of the Kinect's resolution, 1.2 m
/// away.
SyntheticOptions filmed() {
  SyntheticOptions options;
  options.figure = "scalpel";
  options.shape = {.moving = true, .scale = static_cast<float>(kScalpelScale)};
  options.truth = false;
  options.rig.depth_cameras = 2;
  options.rig.depth_width_px = 640;
  options.rig.depth_height_px = 576;
  options.rig.depth_focal_px = 500;
  options.rig.depth_distance_m = 1.2;
  return options;
}

/// Distances of the model are those of the figure, which are found by other means: facets of the round handle
/// (24 sides) are up to 5.5 mm (1 - cos 7.5 degrees) = 0.05 mm below it, rings along it about as much; so of
/// surfaces that are not grazed, 0.3 mm.
TEST(DepthRays, MeetTheModelWhereTheFigureIs) {
  SyntheticSource source(filmed());
  FrameSet frame;
  source.next(frame);
  const BladeModel model = built_in_scalpel();
  const OutlineMesh mesh(model.mesh, "scalpel");
  const Rigidf pose = source.figure().bones(0).front();
  const Rigidd T{mat_cast<double>(pose.R), vec_cast<double>(pose.t)};
  DepthRays rays;
  int count = 0, near = 0;
  for (std::size_t c = 0; c < 2; ++c) {
    for (const DepthRays::Hit& hit : rays.find(mesh, T, source.rig().depth_cameras[c])) {
      const double measured = double{frame.depths_m[c](hit.x_px, hit.y_px)};
      ++count;
      near += std::abs(measured - hit.distance_m) < 3e-4 ? 1 : 0;
    }
  }
  EXPECT_GT(count, 100);
  EXPECT_GT(near, 0.97 * count);  // but at outlines and between parts
}

/// Of single fits, without and with depth.
struct Fitted {
  test::Errors errors[2];
  double variance_m2[2] = {};  ///< sums of what is stated of shifts

  /// Ten frames, from poses that are off.
  void film(std::uint64_t seed) {
    SyntheticSource source(filmed());
    const NoiseOptions noise{.calibration_px = 0.3, .segmentation_px = 1, .seed = seed};
    std::vector<Camera> believed;
    for (const Camera& camera : source.rig().cameras)
      believed.push_back(miscalibrate(camera, noise, static_cast<int>(believed.size())));
    const BladeModel model = built_in_scalpel();
    const OutlineMesh mesh(model.mesh, "scalpel");
    PoseFitter fitters[2] = {{mesh, believed, {}}, {mesh, believed, {}}};
    std::mt19937 random(static_cast<unsigned>(seed));
    std::normal_distribution<float> off_m(0, static_cast<float>(kDepth_m));
    FrameSet frame;
    for (int k = 0; k < 10; ++k) {
      source.next(frame);
      for (std::size_t c = 0; c < believed.size(); ++c)
        disturb_mask(frame.silhouettes[c], noise, static_cast<int>(c), k);
      std::vector<SeenDepth> depths;
      for (std::size_t c = 0; c < frame.depths_m.size(); ++c) {
        for (float& d : frame.depths_m[c].pixels) d += d > 0 ? off_m(random) : 0;
        depths.push_back({&source.rig().depth_cameras[c], &frame.depths_m[c]});
      }
      const Rigidf pose = source.figure().bones(k * test::kFrame_s).front();
      const Rigidd T{mat_cast<double>(pose.R), vec_cast<double>(pose.t)};
      const Rigidd start = moved(T, mesh.center_m, {0.05, 0.03, -0.04, 0.003, -0.004, 0.002});
      for (const std::size_t with : {0U, 1U}) {
        PoseEvidence more;
        if (with == 1) more.depths = depths;
        const PoseFit found = fitters[with].fit(frame.silhouettes, start, 8, nullptr, 12, more);
        errors[with].add(found.T_world_model, T, model);
        errors[with].add_stated(twist_between(T, found.T_world_model, mesh.center_m), found.covariance);
        for (int i = 3; i < 6; ++i) variance_m2[with] += found.covariance(i, i);
      }
    }
  }
};

/// Depth improves the error, and of errors as many are within the stated two sigma: shares of 60 coordinates
/// differ by less than two standard deviations, 2 sqrt(2 0.05 0.95 / 60) = 8 %. An RMS of 10 frames with 3
/// coordinates is known to 1 / sqrt(2 30) of itself, two of which are a quarter. Long: twelve rigs.
TEST(Depth, KeepsTheErrorAndItsBound) {
  Fitted all;
  const bool is_long = std::getenv("TACTUS_LONG_TESTS") != nullptr;
  for (std::uint64_t seed = 1; seed <= (is_long ? 12U : 1U); ++seed) all.film(seed);
  for (const test::Errors& e : all.errors)
    std::printf("  tip %.2f mm, roll %.1f degrees, %.3f within\n", e.tip_mm(), e.roll_deg(),
                e.share_within());
  EXPECT_LT(all.variance_m2[1], all.variance_m2[0]);
  EXPECT_LT(all.errors[1].tip_mm(), 1.25 * all.errors[0].tip_mm());
  EXPECT_GE(all.errors[1].share_within(), all.errors[0].share_within() - 0.08);
}

}  // namespace
}  // namespace tactus
