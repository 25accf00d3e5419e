/// The first pose of a tool, from masks in which nothing was found before.
#include <gtest/gtest.h>

#include "tactus/compute/cpu_for.h"
#include "tactus/track/mask_window.h"
#include "tactus/track/pose_search.h"
#include "track/track_scene.h"

namespace tactus {
namespace {

using test::at_pose;
using test::Room;

/// Against the pixels themselves, over the borders of words and to the last pixel of the last row.
TEST(MaskWindow, ReadsBetweenPixels) {
  std::mt19937 random(5);
  BitMask mask(70, 9);
  for (Index y = 0; y < 9; ++y)
    for (Index x = 0; x < 70; ++x)
      if (random() % 2 == 0) mask.set(x, y);
  MaskWindow window;
  window.open(mask, {33, 2}, {90, 20});
  ASSERT_TRUE(window.is_open());
  EXPECT_EQ(window.x_px(), 32);  // a whole word
  EXPECT_EQ(window.y_px(), 2);
  std::uniform_real_distribution<double> share(0, 1);
  const auto pixel = [&](Index x, Index y) { return mask(x, y) ? 1.0 : 0.0; };
  for (Index y = 2; y < 8; ++y) {
    for (Index x = 32; x < 69; ++x) {
      const double fx = share(random), fy = share(random);
      const double expected = (1 - fy) * ((1 - fx) * pixel(x, y) + fx * pixel(x + 1, y)) +
                              fy * ((1 - fx) * pixel(x, y + 1) + fx * pixel(x + 1, y + 1));
      EXPECT_NEAR(window.at(x - 32 + fx, y - 2 + fy), expected, 1e-6) << x << ' ' << y;
    }
  }
  EXPECT_EQ(window.at(-0.1, 1), 0);
  EXPECT_EQ(window.at(1, 6.1), 0);  // below the last row
  window.open(mask, {10, 20}, {30, 30});
  EXPECT_FALSE(window.is_open());
}

/// Half turns bring a tool back when they are made twice, and leave it between the same ends.
TEST(PoseSearch, HalfTurnsKeepTheTool) {
  const BladeModel model = built_in_scalpel();
  const OutlineMesh mesh(model.mesh, "scalpel");
  std::mt19937 random(6);
  const Rigidd T = test::some_pose(random);
  const LongAxis axis = long_axis(mesh);
  const Vec3d begin_m = mesh.center_m + axis.begin_m * axis.direction,
              end_m = mesh.center_m + axis.end_m * axis.direction;
  const auto turned = turned_over(mesh, T);
  for (std::size_t k = 0; k < 3; ++k) {
    const Rigidd back = turned_over(mesh, turned[k])[k];
    EXPECT_LT(length(back * begin_m - T * begin_m), 1e-9) << k;
    EXPECT_LT(length(vector_of_rotation(back.R * transpose(T.R))), 1e-6) << k;
    EXPECT_NEAR(length(vector_of_rotation(turned[k].R * transpose(T.R))), M_PI, 1e-6) << k;
    const Vec3d stays_m = k == 0 ? begin_m : end_m;  // about the long axis, ends stay; else they swap
    EXPECT_LT(length(turned[k] * begin_m - T * stays_m), 1e-9) << k;
  }
}

/// Of poses that are found one is the tool's: with steps of two
/// pixels of 2.7 mm, to some millimetres. All differ. Bits are the same on one thread: within a loop over the
/// cores, other loops don't use them.
TEST(PoseSearch, FindsTheToolOnAnyNumberOfThreads) {
  const Room room;
  const BladeModel model = built_in_scalpel();
  const OutlineMesh mesh(model.mesh, "scalpel");
  const std::vector<int> radius_px(8, 6);
  PoseSearch search(mesh, room.believed, radius_px, {});
  std::mt19937 random(7);
  for (int k = 0; k < 6; ++k) {
    const Rigidd T = test::some_pose(random);
    const auto masks = room.see({at_pose(model.mesh, T)});
    const std::vector<Rigidd> found = search.find(masks, {}, {});
    ASSERT_FALSE(found.empty());
    int near = 0;
    for (std::size_t a = 0; a < found.size(); ++a) {
      if (!is_other_pose(found[a], T, mesh.center_m)) {
        ++near;
        EXPECT_LT(length(found[a] * mesh.center_m - T * mesh.center_m), 0.005) << k;
      }
      for (std::size_t b = 0; b < a; ++b) EXPECT_TRUE(is_other_pose(found[a], found[b], mesh.center_m));
    }
    EXPECT_EQ(near, 1) << k;
    std::vector<Rigidd> alone[2];
    cpu_for(2, 1, [&](Index i) {
      PoseSearch other(mesh, room.believed, radius_px, {});
      alone[i] = other.find(masks, {}, {});
    });
    for (const auto& again : alone) {
      ASSERT_EQ(again.size(), found.size());
      for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_EQ(again[i].t, found[i].t);
        for (int row = 0; row < 3; ++row) EXPECT_EQ(again[i].R.row[row], found[i].R.row[row]);
      }
    }
  }
  EXPECT_TRUE(search.find(room.see({}), {}, {}).empty());
}

}  // namespace
}  // namespace tactus
