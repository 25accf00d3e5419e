// Cleaning on packed bits against plain loops over pixels.
#include "tactus/geom/image/mask_cleaning.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/masks.h"

namespace tactus {
namespace {

BitMask noise(Index width, Index height, double share, unsigned seed) {
  std::mt19937 random(seed);
  return test::make_mask(width, height,
                         [&](Index, Index) { return static_cast<double>(random()) / 4294967296.0 < share; });
}

/// The disc's rows are as wide as the rounded circle.
bool in_disc(Index dx, Index dy, int radius) {
  return std::abs(dy) <= radius &&
         std::abs(dx) <= std::lround(std::sqrt(static_cast<double>(radius * radius - dy * dy)));
}

BitMask plain_dilate(const BitMask& mask, int radius) {
  return test::make_mask(mask.width_px, mask.height_px, [&](Index x, Index y) {
    for (Index v = std::max(y - radius, 0); v <= std::min(y + radius, mask.height_px - 1); ++v) {
      for (Index u = std::max(x - radius, 0); u <= std::min(x + radius, mask.width_px - 1); ++u) {
        if (mask(u, v) && in_disc(u - x, v - y, radius)) return true;
      }
    }
    return false;
  });
}

BitMask inverse_of(const BitMask& mask) {
  return test::make_mask(mask.width_px, mask.height_px, [&](Index x, Index y) { return !mask(x, y); });
}

TEST(MaskCleaning, DilatesAndErodesAsThePlainLoop) {
  for (const auto& [width, height] : {std::pair{64, 20}, {100, 37}, {31, 9}, {33, 50}, {161, 12}}) {
    MaskCleaner cleaner(width, height);
    for (const int radius : {1, 2, 3, 5, 9, 20, 40}) {
      for (const double share : {0.01, 0.5, 0.99}) {
        const BitMask mask = noise(width, height, share, 7);
        BitMask grown = mask, shrunk = mask;
        cleaner.dilate(grown, radius);
        EXPECT_EQ(grown, plain_dilate(mask, radius)) << width << " " << radius;
        cleaner.erode(shrunk, radius);
        EXPECT_EQ(shrunk, inverse_of(plain_dilate(inverse_of(mask), radius))) << width << " " << radius;
      }
    }
  }
}

/// Labels by flooding; the plain loop.
std::vector<std::vector<Vec2i>> parts_of(const BitMask& mask, bool value, bool corners) {
  std::vector<std::vector<Vec2i>> parts;
  BitMask seen(mask.width_px, mask.height_px);
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index x = 0; x < mask.width_px; ++x) {
      if (mask(x, y) != value || seen(x, y)) continue;
      std::vector<Vec2i> part{{x, y}};
      seen.set(x, y);
      for (std::size_t i = 0; i < part.size(); ++i) {
        for (int k = 0; k < 9; ++k) {
          const Index dx = k % 3 - 1, dy = k / 3 - 1, u = part[i].x + dx, v = part[i].y + dy;
          if (!corners && dx != 0 && dy != 0) continue;
          if (u < 0 || v < 0 || u >= mask.width_px || v >= mask.height_px || mask(u, v) != value ||
              seen(u, v))
            continue;
          seen.set(u, v);
          part.push_back({u, v});
        }
      }
      parts.push_back(std::move(part));
    }
  }
  return parts;
}

TEST(MaskCleaning, PartsAndHolesAreThoseOfTheFlood) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const Index width = 40 + static_cast<Index>(5 * seed), height = 30;
    MaskCleaner cleaner(width, height);
    const BitMask mask = noise(width, height, 0.3 + 0.03 * seed, seed);
    for (const double least : {0.1, 0.6}) {
      BitMask kept = mask, expected(width, height);
      cleaner.keep_parts(kept, least);
      const auto parts = parts_of(mask, true, true);
      std::size_t largest = 0;
      for (const auto& part : parts) largest = std::max(largest, part.size());
      for (const auto& part : parts) {
        if (static_cast<double>(part.size()) < least * static_cast<double>(largest)) continue;
        for (const Vec2i p : part) expected.set(p.x, p.y);
      }
      EXPECT_EQ(kept, expected) << seed << " " << least;
    }
    BitMask filled = mask, expected = mask;
    cleaner.fill_holes(filled, 6);
    for (const auto& hole : parts_of(mask, false, false)) {
      bool at_border = false;
      for (const Vec2i p : hole) at_border |= p.x == 0 || p.y == 0 || p.x + 1 == width || p.y + 1 == height;
      if (at_border || hole.size() >= 6) continue;
      for (const Vec2i p : hole) expected.set(p.x, p.y);
    }
    EXPECT_EQ(filled, expected) << seed;
  }
}

TEST(MaskCleaning, OfTwoPartsTheLargestStays) {
  BitMask mask = test::make_mask(
      80, 40, [](Index x, Index y) { return (x < 10 && y < 10) || (x > 40 && y > 20 && x < 60 && y < 35); });
  MaskCleaner cleaner(80, 40);
  cleaner.keep_parts(mask, 1);
  EXPECT_EQ(mask.area_px(), 19 * 14);
}

}  // namespace
}  // namespace tactus
