#include "tactus/reconstruct/depth/depth_check.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>

#include "tactus/geom/image/mask_growth.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

struct View {
  std::vector<Camera> cameras, depth_cameras;
  std::vector<BitMask> masks;
  std::vector<DepthImage> depths_m;
  Box3f workspace_m;
};

/// The paper's rig, 8 cameras and a depth camera in front of a figure: still, or moving and so far into it.
View figure_view(const std::string& figure, std::optional<int> eighth_s = {}) {
  SyntheticSource source({.figure = figure + (eighth_s ? "-moving" : "-still"), .fps = 8, .truth = false});
  source.seek(eighth_s.value_or(0));
  FrameSet frame;
  source.next(frame);
  const Rig& rig = source.rig();
  return {rig.cameras, rig.depth_cameras, frame.silhouettes, frame.depths_m, rig.workspace_m};
}

/// Masks that lose a rim.
void shrink(std::vector<BitMask>& masks, int px) {
  for (BitMask& mask : masks) {
    BitMask outside(mask.width_px, mask.height_px), grown;
    for (std::size_t i = 0; i < mask.words.size(); ++i) outside.words[i] = ~mask.words[i];
    grow_mask(outside, px, grown);
    for (std::size_t i = 0; i < mask.words.size(); ++i) mask.words[i] &= ~grown.words[i];
  }
}

void z_as_radial(DepthImage& depth_m, const Camera& tof) {
  for (Index y = 0; y < tof.height_px; ++y) {
    for (Index x = 0; x < tof.width_px; ++x)
      depth_m(x, y) *= static_cast<float>(dot(pixel_ray_world(tof, x, y), tof.axis_world()));
  }
}

std::string check(const View& view) {
  return depth_inconsistency(view.cameras, view.masks, view.depth_cameras[0], view.depths_m[0],
                             view.workspace_m);
}

/// Nothing can contradict depth where no camera has a silhouette: walls behind the workspace are no wrong
/// unit.
TEST(DepthCheck, WithoutSilhouettesNothingIsSaid) {
  View view = figure_view("hand");
  for (float& e : view.depths_m[0].pixels) e *= 1000;
  EXPECT_NE(check(view), "");
  for (BitMask& mask : view.masks) mask = {};
  EXPECT_EQ(check(view), "");
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
    z_as_radial(z, tof);
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

/// Adds noise to what is measured.
void disturb(DepthImage& depth_m, float deviation_m, unsigned seed) {
  if (deviation_m <= 0) return;
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, deviation_m);
  for (float& e : depth_m.pixels) e = e > 0 ? e + noise(random) : 0;
}

/// Nor are masks that lost a rim of one to six pixels: the points next to contours then lie before what is
/// left, and the farther from the optical axis the more, as those of z given as radial distance do.
TEST(DepthCheck, MasksThatAreTooSmallAreNoWrongUnit) {
  for (const char* figure : {"sphere", "hand", "rabbit", "scalpel", "bowl", "liver"}) {
    for (int eighth_s = -1; eighth_s < 8; ++eighth_s) {
      const View exact = figure_view(figure, eighth_s < 0 ? std::nullopt : std::optional(eighth_s));
      for (const int px : {1, 2, 3, 4, 6}) {
        for (const float deviation_m : {0.F, 0.01F}) {
          View view = exact;
          shrink(view.masks, px);
          disturb(view.depths_m[0], deviation_m, 7);
          EXPECT_EQ(check(view), "") << figure << " at " << eighth_s << "/8 s, " << px << " px "
                                     << deviation_m;
          for (float& e : view.depths_m[0].pixels) e *= 1000;
          // No sooner for z in millimetres; where hardly a point is left inside, nothing is said at all.
          EXPECT_EQ(check(view).find("z in millimetres"), std::string::npos) << figure << " " << px << " px";
        }
      }
    }
  }
}

/// With masks as poor as that, z given as radial distance is still told from them where it reaches farther
/// than they lost.
TEST(DepthCheck, ZGivenAsRadialIsNamedInSpiteOfMasksThatAreTooSmall) {
  for (const char* figure : {"hand", "rabbit"}) {  // a sphere: the same stretch everywhere fits as well
    for (const int px : {1, 2, 4}) {
      View view = figure_view(figure);
      shrink(view.masks, px);
      z_as_radial(view.depths_m[0], view.depth_cameras[0]);
      EXPECT_NE(check(view).find("looks like z (distance along the optical axis)"), std::string::npos)
          << figure << " " << px << " px: " << check(view);
    }
  }
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
