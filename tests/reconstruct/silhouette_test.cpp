#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "support/device_sets.h"
#include "support/masks.h"
#include "tactus/geom/image/image.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/reconstruct/silhouette_stage.h"

namespace tactus {
namespace {

using test::make_mask;

/// A node (x, y, z) is seen at pixel (x, y).
HullCamera flat_camera(Index width_px, Index height_px) {
  HullCamera camera{};
  camera.row[0] = {1, 0, 0};
  camera.row[1] = {0, 1, 0};
  camera.offset[2] = 1;
  camera.width_px = width_px;
  camera.height_px = height_px;
  return camera;
}

/// Blobs with holes and single pixels, up to the borders.
BitMask random_mask(Index width, Index height, std::mt19937& random) {
  const double cx = random() % 60, cy = random() % 60, radius = 10 + random() % 40;
  return make_mask(width, height, [&](Index x, Index y) {
    const bool inside = std::hypot(x - cx, y - cy) < radius;
    return random() % 997 == 0 ? !inside : inside;
  });
}

/// What the pixels say that bilinear samples of the rectangle read, one by one.
struct Pixels {
  bool any_set = false, any_clear = false, whole = false, unseen = false;
  Index span = 0;
  Pixels(const BitMask& mask, double u0, double u1, double v0, double v1) {
    const Index width = mask.width_px, height = mask.height_px;
    whole = u0 >= -0.5 && u1 <= width - 0.5 && v0 >= -0.5 && v1 <= height - 0.5;
    unseen = u1 < -0.5 || u0 > width - 0.5 || v1 < -0.5 || v0 > height - 0.5;
    const auto pixels = [](double low, double high, Index count) {
      low = std::clamp(low, -0.5, count - 0.5);
      high = std::clamp(high, -0.5, count - 0.5);
      return std::pair{std::max(static_cast<Index>(std::floor(low)), 0),
                       std::min(static_cast<Index>(std::floor(high)) + 1, count - 1)};
    };
    const auto [x0, x1] = pixels(u0, u1, width);
    const auto [y0, y1] = pixels(v0, v1, height);
    span = std::max(x1 - x0, y1 - y0) + 1;
    for (Index y = y0; y <= y1; ++y) {
      for (Index x = x0; x <= x1; ++x) (mask(x, y) ? any_set : any_clear) = true;
    }
  }
};

class Footprints : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(Footprints);

TEST_P(Footprints, AreWhatThePixelsSay) {
  DeviceSet set(GetParam(), 3);
  ExecContext& ctx = set.context(0);
  std::mt19937 random(5);
  SilhouetteLayout layout;
  std::vector<BitMask> masks;
  for (const auto& [width, height] : {std::pair{100, 75}, {64, 33}, {31, 90}}) {
    layout.add(flat_camera(width, height), {50, 40, 0}, "flat");
    ASSERT_GE(layout.cameras.back().windows_begin, 0);
    masks.push_back(random_mask(width, height, random));
  }
  SilhouettePart part;
  part.each_buffer(layout, [&](Buffer<std::uint32_t>& buffer, std::int64_t count) {
    buffer = Buffer<std::uint32_t>(ctx.device(), count);
  });
  part.set_up(ctx, layout);
  std::vector<std::uint32_t> raw(static_cast<std::size_t>(part.raw.size()));
  for (std::size_t c = 0; c < masks.size(); ++c)
    std::copy(masks[c].words.begin(), masks[c].words.end(), raw.begin() + layout.cameras[c].raw_begin);
  ctx.upload(std::span<const std::uint32_t>(raw), part.raw.view());
  part.prepare(ctx);
  part.sum_cells(ctx);
  part.prepare_windows(ctx);
  const std::vector<std::uint32_t> cells = to_host(ctx, part.cells.const_view());

  std::uniform_real_distribution<float> at(-20, 120), half_of(0.1F, 12);
  int decided = 0, small = 0;
  for (int i = 0; i < 30'000; ++i) {
    const std::size_t c = random() % masks.size();
    const float x = at(random), y = at(random), half = half_of(random);
    const std::uint32_t verdict = classify_footprint(layout.cameras[c], cells.data(), {x, y, 0}, half);
    const bool outside = (verdict & kOutsideFootprint) != 0, inside = (verdict & kInsideFootprint) != 0;
    // A rectangle a little smaller and one a little larger than what the 0.02 px for rounding make of it.
    const auto pixels = [&](double margin) {
      return Pixels(masks[c], x - half - margin, x + half + margin, y - half - margin, y + half + margin);
    };
    const Pixels least = pixels(0.0199), most = pixels(0.0201);
    // Never a verdict that a pixel speaks against...
    EXPECT_FALSE(outside && (least.any_set || !least.whole)) << i;
    EXPECT_FALSE(inside && least.any_clear && !most.unseen) << i;
    // ... and, of what two windows cover, always one that no pixel speaks against.
    if (most.span > 2 * kLargestWindow) continue;
    // Windows wider than the rectangle reach over its right and lower side.
    const double left = std::max(x - half - 0.0201, 0.0), top = std::max(y - half - 0.0201, 0.0);
    const Pixels reach(masks[c], x - half - 0.0201,
                       std::max<double>(x + half + 0.0201, left + kLargestWindow), y - half - 0.0201,
                       std::max<double>(y + half + 0.0201, top + kLargestWindow));
    EXPECT_TRUE(inside || reach.any_clear) << i;
    EXPECT_TRUE(outside || reach.any_set || !most.whole) << i;
    decided += outside || (inside && !least.unseen) ? 1 : 0;
    ++small;
  }
  EXPECT_GT(small, 10'000);
  EXPECT_GT(decided, small / 10);
}

}  // namespace
}  // namespace tactus
