#include "tactus/reconstruct/texture/seam_levelling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr Index kCells = 20;                      // of each half, along each side
constexpr Index kCellPx = 4;                      // a triangle's legs in the atlas
constexpr Index kHalfPx = kCells * kCellPx + 10;  // of a page, with its margin

double to_linear(std::uint8_t v) {
  const double s = v / 255.0;
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}
std::uint8_t to_srgb(double v) {
  return static_cast<std::uint8_t>(
      std::lround(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055)));
}

/// A square of two halves, each cut from its photo (page), which saw the same pattern: stripes of +-20 %, in
/// linear light, times the photo's exposure.
TexturedMesh two_halves(double left_exposure, double right_exposure) {
  TexturedMesh t;
  t.atlas = ColorImage(2 * kHalfPx, kHalfPx, {255, 255, 255});
  for (Index y = 0; y < kHalfPx; ++y) {
    for (Index x = 0; x < 2 * kHalfPx; ++x) {
      const double linear = (y % 8 < 4 ? 0.24 : 0.16) * (x < kHalfPx ? left_exposure : right_exposure);
      t.atlas(x, y) = {to_srgb(linear), to_srgb(linear), to_srgb(linear)};
    }
  }
  for (const Index half : {0, 1}) {
    const auto first = static_cast<Index>(t.mesh.positions_m.size());
    for (Index j = 0; j <= kCells; ++j) {
      for (Index i = 0; i <= kCells; ++i) {
        t.mesh.positions_m.push_back({static_cast<float>(i + half * kCells), static_cast<float>(j), 0});
        t.uv.push_back({static_cast<float>(half * kHalfPx + 5 + i * kCellPx) / (2 * kHalfPx),
                        static_cast<float>(5 + j * kCellPx) / kHalfPx});
        t.colors.push_back({255, 255, 255});
        t.photo.push_back(half);
      }
    }
    for (Index j = 0; j < kCells; ++j) {
      for (Index i = 0; i < kCells; ++i) {
        const Index a = first + j * (kCells + 1) + i, b = a + 1, c = a + kCells + 1, d = c + 1;
        t.mesh.triangles.push_back({a, b, d});
        t.mesh.triangles.push_back({a, d, c});
      }
    }
  }
  return t;
}

double linear_at(const TexturedMesh& t, Index half, double cell_x, Index y) {
  return to_linear(t.atlas(half * kHalfPx + 5 + static_cast<Index>(cell_x * kCellPx), y).g);
}

TEST(SeamLevelling, BothSidesBecomeEqualAndDetailStays) {
  TexturedMesh t = two_halves(1, 1.5);
  const TexturedMesh before = t;
  const SeamSteps steps = level_seams(t);
  EXPECT_EQ(steps.seams, static_cast<std::size_t>(kCells + 1));
  EXPECT_NEAR(steps.before, std::log(1.5), 0.02);  // 8 bits: half a level of 110 and of 90
  // One gain a half closes the step for nothing but kKeep: 21 vertices * 5e-4 * half the step.
  EXPECT_LT(steps.after, 0.01 * steps.before);
  for (const Index y : {14, 30, 50, 66}) {
    // Half a level of 90 or more on both sides, twice (photo and result): 4 * 0.7 %.
    EXPECT_NEAR(linear_at(t, 1, 0.5, y) / linear_at(t, 0, 19.5, y), 1, 0.028) << y;
  }
  // The same gain on both sides, one up and one down: the middle stays.
  EXPECT_NEAR(linear_at(t, 0, 10, 41) / linear_at(before, 0, 10, 41), std::sqrt(1.5), 0.03);
  for (const Index half : {0, 1}) {
    for (const double x : {3.5, 10.5, 16.5})  // stripes keep their contrast, to rounding as above
      EXPECT_NEAR(linear_at(t, half, x, 41) / linear_at(t, half, x, 45), 1.5, 0.042);
  }
}

TEST(SeamLevelling, EqualPhotosAndOtherThingsAreLeftAlone) {
  for (const double right : {1.0, 3.0}) {  // 3: the other photo shows something else
    TexturedMesh t = two_halves(1, right);
    const ColorImage atlas = t.atlas;
    level_seams(t);
    EXPECT_EQ(t.atlas.pixels, atlas.pixels) << right;
  }
}

TEST(SeamLevelling, VerticesWithoutAPhotoFollow) {
  // The right half has no photo but colours of its own, half as bright.
  TexturedMesh t = two_halves(1, 1);
  const std::uint8_t half = to_srgb(0.1);
  for (std::size_t i = 0; i < t.photo.size(); ++i) {
    if (t.photo[i] == 0) continue;
    t.photo[i] = -1;
    t.uv[i] = {0.75F, 0.5F};
    t.colors[i] = {half, half, half};
  }
  const ColorImage atlas = t.atlas;
  level_seams(t);
  const double left = linear_at(t, 0, 10.5, 41) / 0.24;  // the gain
  EXPECT_NEAR(left * left, 0.5, 0.05);                 // stripes: bright and dark are not seen equally often
  const std::size_t middle = 3 * t.colors.size() / 4;  // as far from the seam
  EXPECT_NEAR(to_linear(t.colors[middle].g) / 0.1, 1 / left, 0.03);
  EXPECT_EQ(t.atlas(kHalfPx + 40, 40), atlas(kHalfPx + 40, 40));
}

TEST(SeamLevelling, RefusesWhatDoesNotFit) {
  TexturedMesh t = two_halves(1, 1);
  t.photo.pop_back();
  EXPECT_THROW(level_seams(t), Error);
}

}  // namespace
}  // namespace tactus
