#include "tactus/reconstruct/depth_check.h"

#include <gtest/gtest.h>

#include <random>

#include "tactus/geom/mask_growth.h"
#include "tactus/rig/synthetic_source.h"

namespace tactus {
namespace {

struct View {
  std::vector<Camera> cameras, depth_cameras;
  std::vector<BitMask> masks;
  std::vector<DepthImage> depths_m;
  Box3f workspace_m;
};

/// The paper's rig, 8 cameras and a depth camera in front of a still figure.
View figure_view(const std::string& figure) {
  SyntheticSource source({.figure = figure + "-still", .truth = false});
  FrameSet frame;
  source.next(frame);
  const Rig& rig = source.rig();
  return {rig.cameras, rig.depth_cameras, frame.silhouettes, frame.depths_m, rig.workspace_m};
}

TEST(DepthCheck, WrongUnitsAreNamed) {
  for (const char* figure : {"sphere", "hand", "rabbit", "scalpel", "bowl", "liver"}) {
    const View good = figure_view(figure);
    const Camera& tof = good.depth_cameras.front();
    const auto check = [&](const DepthImage& depth_m) {
      return depth_inconsistency(good.cameras, good.masks, tof, depth_m, good.workspace_m);
    };
    EXPECT_EQ(check(good.depths_m[0]), "") << figure;
    DepthImage mm = good.depths_m[0], z = mm, wall = mm;
    for (float& e : mm.pixels) e *= 1000;
    for (float& e : wall.pixels) e = e > 0 ? e : 2.3F;
    for (Index y = 0; y < tof.height_px; ++y) {
      for (Index x = 0; x < tof.width_px; ++x)
        z(x, y) *= static_cast<float>(dot(pixel_ray_world(tof, x, y), tof.axis_world()));
    }
    EXPECT_EQ(check(wall), "") << figure;
    EXPECT_NE(check(mm).find("camera 'tof' looks like millimetres given as metres"), std::string::npos)
        << figure;
    // Near the optical axis z and radial distance are the same: only what reaches out shows the difference.
    const bool reaches_out = std::string(figure) != "liver";
    EXPECT_EQ(check(z).find("looks like z (distance along the optical axis)") != std::string::npos,
              reaches_out)
        << figure << ": " << check(z);
  }
}

/// Noise puts half of the points before the surface, outside of tight silhouettes; that is no wrong unit.
TEST(DepthCheck, NoiseIsNoWrongUnit) {
  std::mt19937 random(3);
  for (const char* figure : {"sphere", "hand", "rabbit", "scalpel", "bowl", "liver"}) {
    for (const float deviation_m : {0.003F, 0.01F, 0.03F}) {
      View view = figure_view(figure);
      DepthImage& depth_m = view.depths_m[0];
      std::normal_distribution<float> noise(0, deviation_m);
      for (float& e : depth_m.pixels) e = e > 0 ? e + noise(random) : 0;
      const auto check = [&] {
        return depth_inconsistency(view.cameras, view.masks, view.depth_cameras[0], depth_m,
                                   view.workspace_m);
      };
      EXPECT_EQ(check(), "") << figure << " " << deviation_m;
      for (float& e : depth_m.pixels) e *= 1000;
      EXPECT_NE(check().find(" millimetres "), std::string::npos) << figure << " " << deviation_m;
    }
  }
}

/// Nor are masks that lost a rim of one to four pixels.
TEST(DepthCheck, MasksThatAreTooSmallAreNoWrongUnit) {
  for (const char* figure : {"sphere", "hand", "rabbit", "bowl"}) {
    for (const int px : {1, 2, 3, 4}) {
      View view = figure_view(figure);
      for (BitMask& mask : view.masks) {
        BitMask outside(mask.width_px, mask.height_px), grown;
        for (std::size_t i = 0; i < mask.words.size(); ++i) outside.words[i] = ~mask.words[i];
        grow_mask(outside, px, grown);
        for (std::size_t i = 0; i < mask.words.size(); ++i) mask.words[i] &= ~grown.words[i];
      }
      EXPECT_EQ(depth_inconsistency(view.cameras, view.masks, view.depth_cameras[0], view.depths_m[0],
                                    view.workspace_m),
                "")
          << figure << " " << px;
    }
  }
}

/// Adds noise to what is measured.
void disturb(DepthImage& depth_m, float deviation_m, unsigned seed) {
  if (deviation_m <= 0) return;
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, deviation_m);
  for (float& e : depth_m.pixels) e = e > 0 ? e + noise(random) : 0;
}

void grow(std::vector<BitMask>& masks, Index px) {
  for (BitMask& mask : masks) {
    BitMask grown;
    grow_mask(mask, px, grown);
    mask = grown;
  }
}

/// What a source makes of radial distances that it takes for z: too long by 1/cos.
TEST(DepthCheck, RadialGivenAsZIsNamedWhereItShows) {
  for (const char* figure : {"sphere", "hand", "rabbit", "scalpel", "bowl", "liver"}) {
    for (const float deviation_m : {0.F, 0.003F, 0.01F}) {
      for (unsigned seed = 1; seed < 4; ++seed) {
        View view = figure_view(figure);
        const Camera& tof = view.depth_cameras.front();
        DepthImage& depth_m = view.depths_m[0];
        disturb(depth_m, deviation_m, seed);
        for (Index y = 0; y < tof.height_px; ++y) {
          for (Index x = 0; x < tof.width_px; ++x)
            depth_m(x, y) /= static_cast<float>(dot(pixel_ray_world(tof, x, y), tof.axis_world()));
        }
        const std::string said =
            depth_inconsistency(view.cameras, view.masks, tof, depth_m, view.workspace_m);
        // Behind the front of a sphere, a bowl or a liver there is so much hull that points moved back by 1 %
        // of 1.3 m stay in it: no silhouette contradicts them, and nothing may be said.
        const bool thin = std::string("hand rabbit scalpel").find(figure) != std::string::npos;
        EXPECT_EQ(said.find("looks like radial distance given as z") != std::string::npos, thin)
            << figure << " " << deviation_m << ": " << said;
        EXPECT_EQ(said.empty(), !thin) << figure;
      }
    }
  }
}

TEST(DepthCheck, RightDepthRaisesNoAlarm) {
  for (const char* figure : {"sphere", "hand", "rabbit", "scalpel", "bowl", "liver"}) {
    for (const float deviation_m : {0.F, 0.003F, 0.01F, 0.03F}) {
      for (const Index px : {0, 2, 4}) {
        for (unsigned seed = 1; seed < 4; ++seed) {
          View view = figure_view(figure);
          disturb(view.depths_m[0], deviation_m, seed);
          grow(view.masks, px);
          EXPECT_EQ(depth_inconsistency(view.cameras, view.masks, view.depth_cameras[0], view.depths_m[0],
                                        view.workspace_m),
                    "")
              << figure << " " << deviation_m << " " << px;
        }
      }
    }
  }
}

}  // namespace
}  // namespace tactus
