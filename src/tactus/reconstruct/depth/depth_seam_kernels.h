#pragma once
/// The seam between the measured surface and the silhouettes' one. Full correction beside none would leave a
/// step, so depth carves a little less towards a hole in the measurement: a ramp, as long as `fade_m`
/// reaches. A pixel without depth is a hole only where the silhouettes' hull goes on in front of the measured
/// surface; beside the object there is nothing to join.
#include "tactus/reconstruct/depth/depth_kernels.h"

namespace tactus {

/// Depth gives way over so many pixels.
inline constexpr Index kFadePixels = 3;
static_assert(kFadePixels <= kDepthPadding);

/// A tile of 32x32 pixels is one cell of the pyramid's last level.
TACTUS_HD inline Index tile_cell(const DepthCamera& c, Index x, Index y) {
  constexpr int kLast = kDepthLevels - 1;
  return c.cells_begin[kLast] + (y >> kDepthLevels) * c.cells_row[kLast] + (x >> kDepthLevels);
}
/// Whether any of the 3x3 tiles around the pixel's has flag(cell).
template <class F>
TACTUS_HD bool any_tile_around(const DepthCamera& c, Vec3i tile, F&& flag) {
  const Index x_end = c.image.width_px - 1, y_end = c.image.height_px - 1;
  bool any = false;
  for (Index y = max(tile.z - kDepthTile, 0); y <= min(tile.z + kDepthTile, y_end); y += kDepthTile) {
    for (Index x = max(tile.y - kDepthTile, 0); x <= min(tile.y + kDepthTile, x_end); x += kDepthTile)
      any = any || flag(tile_cell(c, x, y));
  }
  return any;
}

/// Finds the pixels without depth that are holes, near pixels with depth. One block is a tile.
struct FindHoles {
  View<const DepthCamera> cameras;
  View<const HullCamera> silhouettes;
  View<const std::uint32_t> bits;
  View<const float> raw, usable;
  View<const float> low, high;  ///< the pyramid
  View<const Vec3i> tiles;
  View<std::uint8_t> holes;       ///< out: 1 for a hole; 0 before
  View<std::uint8_t> tile_holes;  ///< out, per tile_cell: 1 when a pixel is a hole; 0 before

  static constexpr int kThreads = 256, kRows = kDepthTile + 2 * kFadePixels;
  struct Shared {
    std::int32_t near_usable[kRows * kDepthTile];  ///< a usable pixel within kFadePixels along the row
    std::int32_t hole[kDepthTile * kDepthTile], column[kDepthTile];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i tile = tiles[b.index()];
    const DepthCamera c = cameras[tile.x];
    const Index own = tile_cell(c, tile.y, tile.z);
    if (low[own] > 0 || !any_tile_around(c, tile, [&](Index cell) { return high[cell] > 0; })) return;
    const Index width = c.image.width_px, height = c.image.height_px;
    const auto all = [](int) { return true; };
    b.template for_groups<kDepthTile>(kRows, all, [&](int row, int t) {
      const float* pixels =
          usable.data() + c.begin + clamp(tile.z + row - kFadePixels, 0, height - 1) * c.row;
      float most = 0;
      for (Index dx = -kFadePixels; dx <= kFadePixels; ++dx) most = max(most, pixels[tile.y + t + dx]);
      s.near_usable[row * kDepthTile + t] = most > 0 ? 1 : 0;
    });
    b.template for_groups<kDepthTile>(kDepthTile, all, [&](int row, int t) {
      const float* pixels = raw.data() + c.begin + min(tile.z + row, height - 1) * c.row;
      std::int32_t near = 0;
      for (int dy = 0; dy <= 2 * kFadePixels; ++dy) near |= s.near_usable[(row + dy) * kDepthTile + t];
      s.hole[row * kDepthTile + t] = pixels[tile.y + t] > 0 ? 0 : near;
    });
    b.template for_groups<kDepthTile>(kDepthTile, all, [&](int row, int t) {
      std::int32_t& hole = s.hole[row * kDepthTile + t];
      const Index x = tile.y + t, y = tile.z + row;
      if (hole == 0) return;
      hole = x < width && y < height && is_hole(c, x, y) ? 1 : 0;
      if (hole != 0) holes[c.begin + y * c.row + x] = 1;
    });
    b.for_threads(kDepthTile, [&](int t) {
      s.column[t] = 0;
      for (int row = 0; row < kDepthTile; ++row) s.column[t] |= s.hole[row * kDepthTile + t];
    });
    b.on_one_thread([&] {
      std::int32_t any = 0;
      for (const std::int32_t column : s.column) any |= column;
      tile_holes[own] = static_cast<std::uint8_t>(any);
    });
  }

 private:
  /// Whether the hull holds the point a quarter of the ramp in front of the farthest surface around. (The
  /// nearest lies, where the surface is steep, in front of the hull.)
  TACTUS_HD bool is_hole(const DepthCamera& c, Index x, Index y) const {
    float e = 0;
    for (Index v = max(y - kFadePixels, 0); v <= min(y + kFadePixels, c.image.height_px - 1); ++v) {
      for (Index u = max(x - kFadePixels, 0); u <= min(x + kFadePixels, c.image.width_px - 1); ++u)
        e = max(e, usable[c.begin + v * c.row + u]);
    }
    const Vec3f ray = c.ray + static_cast<float>(x) * c.ray_per_u + static_cast<float>(y) * c.ray_per_v;
    const Vec3f node = c.center + ((e - 0.25F * c.fade_m) / (c.voxel_size_m * length(ray))) * ray;
    for (Index i = 0; i < silhouettes.size(); ++i) {
      const HullCamera camera = silhouettes[i];
      if (sample_silhouette(camera, bits.data(), project_node(camera, node)) < 0) return false;
    }
    return true;
  }
};

/// The distances that carve: those of usable pixels, less near a hole or the border of the image. Never more.
/// One block is a tile.
struct FadeDepth {
  View<const DepthCamera> cameras;
  View<const float> usable, high;  ///< high: of the pyramid
  View<const std::uint8_t> holes, tile_holes;
  View<const Vec3i> tiles;
  View<float> carving;  ///< out

  static constexpr int kThreads = 256, kRows = kDepthTile + 2 * kFadePixels;
  struct Shared {
    std::int32_t along[kRows * kDepthTile];  ///< pixels along the row to the next hole
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i tile = tiles[b.index()];
    const DepthCamera c = cameras[tile.x];
    const Index width = c.image.width_px, height = c.image.height_px;
    const bool has_holes = any_tile_around(c, tile, [&](Index cell) { return tile_holes[cell] != 0; });
    b.template for_groups<kDepthTile>(
        kRows, [has_holes](int) { return has_holes; },
        [&](int row, int t) {
          const Index y = clamp(tile.z + row - kFadePixels, 0, height - 1);
          const std::uint8_t* pixels = holes.data() + c.begin + y * c.row;
          std::int32_t nearest = kFadePixels + 1;
          for (Index dx = -kFadePixels; dx <= kFadePixels; ++dx) {
            nearest = min(nearest, pixels[tile.y + t + dx] == 0 ? kFadePixels + 1 : max(dx, -dx));
          }
          s.along[row * kDepthTile + t] = nearest;
        });
    const auto real = [&](int row) { return tile.z + row < height; };
    const bool at_border = min(tile.y, tile.z) < kFadePixels || tile.y + kDepthTile + kFadePixels > width ||
                           tile.z + kDepthTile + kFadePixels > height;
    if ((!at_border && !has_holes) || !(high[tile_cell(c, tile.y, tile.z)] > 0)) {  // nothing to fade
      b.template for_groups<kDepthTile>(kDepthTile, real, [&](int row, int t) {
        const Index at = c.begin + (tile.z + row) * c.row + tile.y + t;
        carving[at] = usable[at];
      });
      return;
    }
    b.template for_groups<kDepthTile>(kDepthTile, real, [&](int row, int t) {
      const Index x = tile.y + t, y = tile.z + row;
      std::int32_t nearest = min(min(min(x, width - 1 - x), min(y, height - 1 - y)) + 1, kFadePixels + 1);
      for (Index dy = has_holes ? -kFadePixels : kFadePixels + 1; dy <= kFadePixels; ++dy)
        nearest = min(nearest, max(max(dy, -dy), s.along[(row + kFadePixels + dy) * kDepthTile + t]));
      const Index at = c.begin + y * c.row + x;
      const float e = usable[at];
      const float share =
          static_cast<float>(kFadePixels + 1 - nearest) * (1.F / static_cast<float>(kFadePixels));
      const float faded = max(fma(-c.fade_m, share, e), 1e-3F * e);
      carving[at] = e > 0 ? faded : 0.F;
    });
  }
};

}  // namespace tactus
