#pragma once
/// Time-of-flight images on the device: which pixels can be used, a min/max pyramid of them, and the vote of
/// depth on boxes and nodes. D = A - E [P 1], A the distance of a point from the camera, E the measured one
/// in its direction: D < 0 is free space in front of the surface. No measurement is no evidence.
#include "tactus/reconstruct/hull_kernels.h"

namespace tactus {

inline constexpr int kMaxDepthCameras = 32;
/// The pyramid has cells of 2, 4, .. 32 pixels; larger footprints loop over the largest.
inline constexpr int kDepthLevels = 5;
inline constexpr Index kDepthTile = 1 << kDepthLevels;
/// Zeros (no measurement) behind each row and before the first, so that neighbours need no guard.
inline constexpr Index kDepthPadding = 8;
/// D where nothing is known; like every D >= 0 it carves nothing.
inline constexpr float kUnknownDepth_m = 1e30F;

/// One depth camera as the hull sees it.
struct DepthCamera {
  HullCamera image;  ///< its projection and size; it has no silhouette
  Vec3f center;      ///< optical centre, padded node units
  /// Along the ray of pixel (u,v): ray + u ray_per_u + v ray_per_v, any length.
  Vec3f ray, ray_per_u, ray_per_v;
  float voxel_size_m;
  float jump_m;      ///< a larger step between two neighbours: neither is used
  float fade_m;      ///< how far before the surface carving ends beside a hole (see depth_seam_kernels.h)
  Index begin, row;  ///< pixel (x,y) is begin + y row + x; each row ends with kDepthPadding zeros
  Index cells_begin[kDepthLevels];  ///< of the cells 2, 4, .. pixels wide
  Index cells_row[kDepthLevels];
};

/// D [m] at a node or between nodes, kUnknownDepth_m where the camera does not look or one of the four pixels
/// around is not usable. Without branches: loops over nodes vectorise.
TACTUS_HD inline float sample_depth_m(const DepthCamera& c, const float* carving, Vec3f node) {
  const Vec3f h = project_node(c.image, node);
  const bool in_front = h.z > 1e-6F;
  const float inverse_z = 1.F / (in_front ? h.z : 1.F);
  const float u = h.x * inverse_z, v = h.y * inverse_z;
  const float u_end = static_cast<float>(c.image.width_px - 1),
              v_end = static_cast<float>(c.image.height_px - 1);
  const float u_seen = clamp(u, 0.F, u_end), v_seen = clamp(v, 0.F, v_end);
  const Index x = min(static_cast<Index>(u_seen), c.image.width_px - 2),
              y = min(static_cast<Index>(v_seen), c.image.height_px - 2);
  const float fu = u_seen - static_cast<float>(x), fv = v_seen - static_cast<float>(y);
  const Index at = c.begin + y * c.row + x;
  const float e00 = carving[at], e10 = carving[at + 1], e01 = carving[at + c.row],
              e11 = carving[at + c.row + 1];
  const bool known = in_front & (u == u_seen) & (v == v_seen) & (e00 > 0) & (e10 > 0) & (e01 > 0) & (e11 > 0);
  const float top = fma(fu, e10 - e00, e00), bottom = fma(fu, e11 - e01, e01);
  const Vec3f d = node - c.center;
  const float distance_m = c.voxel_size_m * sqrt(fma(d.x, d.x, fma(d.y, d.y, d.z * d.z)));
  return known ? distance_m - fma(fv, bottom - top, top) : kUnknownDepth_m;
}

/// State of a box of nodes by depth (centre and half extent in padded node units), conservatively: outside
/// when every point of it is seen in front of the surface, inside when none is (method: "Extended voxel
/// visual hull"). `low` and `high` are the pyramid's smallest and largest usable distances, 0 in `low` where
/// a pixel is not usable.
TACTUS_HD inline Footprint classify_depth(const DepthCamera& c, const float* low, const float* high,
                                          Vec3f center, float half) {
  const auto reach = [half](Vec3f row) { return half * (abs(row.x) + abs(row.y) + abs(row.z)); };
  const Vec3f h = project_node(c.image, center);
  const float depth_reach = reach(c.image.row[2]), nearest = h.z - depth_reach;
  if (h.z + depth_reach <= 1e-6F) return {false, true};
  if (!(nearest > 1e-6F * depth_reach)) return {false, false};
  const float u = h.x / h.z, v = h.y / h.z, inverse_nearest = 1.F / nearest;
  // As in classify_footprint: 0.02 px cover the rounding of both projections.
  const float du = fma(reach(c.image.row[0] - u * c.image.row[2]), inverse_nearest, 0.02F);
  const float dv = fma(reach(c.image.row[1] - v * c.image.row[2]), inverse_nearest, 0.02F);
  const float u_end = static_cast<float>(c.image.width_px - 1),
              v_end = static_cast<float>(c.image.height_px - 1);
  if (u + du < 0 || u - du > u_end || v + dv < 0 || v - dv > v_end) return {false, true};
  const bool whole = u - du >= 0 && u + du <= u_end && v - dv >= 0 && v + dv <= v_end;
  const Index x0 = static_cast<Index>(max(u - du, 0.F)), y0 = static_cast<Index>(max(v - dv, 0.F));
  const Index x1 = min(static_cast<Index>(min(u + du, u_end)) + 1, c.image.width_px - 1),
              y1 = min(static_cast<Index>(min(v + dv, v_end)) + 1, c.image.height_px - 1);
  int level = 0;  // of cells 2 << level pixels wide
  while (level + 1 < kDepthLevels && max(x1 - x0, y1 - y0) > (2 << level)) ++level;
  float least = 1e30F, most = 0;
  for (Index y = y0 >> (level + 1); y <= y1 >> (level + 1); ++y) {
    for (Index x = x0 >> (level + 1); x <= x1 >> (level + 1); ++x) {
      const Index at = c.cells_begin[level] + y * c.cells_row[level] + x;
      least = min(least, low[at]);
      most = max(most, high[at]);
    }
  }
  // Distances of the box: centre -+ half its diagonal; 1e-5 covers the rounding of A and of E's
  // interpolation.
  const float distance_m = c.voxel_size_m * length(center - c.center),
              radius_m = c.voxel_size_m * half * 1.7320509F, rounding_m = 1e-5F * (distance_m + radius_m);
  const bool outside = whole && distance_m + radius_m + rounding_m + c.fade_m < least;
  const bool inside = distance_m - radius_m - rounding_m > most;
  return {outside, inside};
}

/// Usable pixels and their pyramid; one block is a tile of 32x32 pixels. A pixel beside a jump mixes two
/// surfaces ("flying") and is not used.
struct PrepareDepth {
  View<const DepthCamera> cameras;
  View<const float> raw;
  View<const Vec3i> tiles;  ///< (camera, first x, first y), one per block
  View<float> usable;       ///< out: the distance, or 0
  View<float> low, high;    ///< out: see classify_depth

  static constexpr int kThreads = 256;
  struct Shared {
    float low[2][kDepthTile * kDepthTile], high[2][kDepthTile * kDepthTile];  ///< of two levels in turn
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i tile = tiles[b.index()];
    const DepthCamera c = cameras[tile.x];
    const Index width = c.image.width_px, height = c.image.height_px;
    b.template for_groups<kDepthTile>(
        kDepthTile, [](int) { return true; },
        [&](int row, int t) {
          const Index y = min(tile.z + row, height - 1), x = tile.y + t;
          const float e = use(c, x, y);
          // Beyond the image there is nothing that could speak against a cell.
          const bool real = (x < width) & (tile.z + row < height);
          s.low[0][row * kDepthTile + t] = real ? e : 1e30F;
          s.high[0][row * kDepthTile + t] = real ? e : 0.F;
        });
    b.template for_groups<kDepthTile>(
        kDepthTile, [&](int row) { return tile.z + row < height; },
        [&](int row, int t) {
          usable[c.begin + (tile.z + row) * c.row + tile.y + t] = s.high[0][row * kDepthTile + t];
        });
    for (int level = 0; level < kDepthLevels; ++level) reduce(b, s, c, tile, level);
  }

 private:
  TACTUS_HD float use(const DepthCamera& c, Index x, Index y) const {
    const float* row = raw.data() + c.begin + y * c.row;
    const float *row_above = y > 0 ? row - c.row : row,
                *row_below = y + 1 < c.image.height_px ? row + c.row : row;
    const float e = row[x], left = row[x - 1], right = row[x + 1], above = row_above[x], below = row_below[x];
    const auto jumps = [&](float n) { return (n > 0) & (abs(n - e) > c.jump_m); };
    return jumps(left) | jumps(right) | jumps(above) | jumps(below) ? 0.F : e;
  }

  template <class Block>
  TACTUS_HD void reduce(const Block& b, Shared& s, const DepthCamera& c, Vec3i tile, int level) const {
    const int from = level & 1, n = kDepthTile >> (level + 1), shift = level + 1;
    const Index first_x = tile.y >> shift, first_y = tile.z >> shift, row = c.cells_row[level];
    const Index columns = min(ceil_div(c.image.width_px, 1 << shift) - first_x, n),
                lines = min(ceil_div(c.image.height_px, 1 << shift) - first_y, n);
    b.for_threads(n * n, [&](int t) {
      const int x = t % n, y = t / n, at = 2 * (y * 2 * n + x), below = at + 2 * n;
      const float* l = s.low[from];
      const float* h = s.high[from];
      const float least = min(min(l[at], l[at + 1]), min(l[below], l[below + 1])),
                  most = max(max(h[at], h[at + 1]), max(h[below], h[below + 1]));
      s.low[1 - from][t] = least;
      s.high[1 - from][t] = most;
      if (x < columns && y < lines) {
        const Index out = c.cells_begin[level] + (first_y + y) * row + first_x + x;
        low[out] = least;
        high[out] = most;
      }
    });
  }
};

/// Depth votes on the bricks that ClassifyBricks sorted: wholly in front of the surface is outside, near the
/// surface is active. One block is 4^3 bricks.
struct VoteDepth {
  HullGrid grid;
  View<const DepthCamera> cameras;
  View<const float> low, high;
  View<std::uint32_t> tiles;        ///< in and out, as ClassifyBricks
  View<Index> tile_active;          ///< in and out
  View<std::uint32_t> block_depth;  ///< out: bit d set: depth camera d carves within the block

  static constexpr int kThreads = 64;
  struct Shared {
    std::uint32_t carving[kMaxDepthCameras], any;  ///< cameras that carve anything in the block
    BlockStates states;
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i first = kBlockBricks * grid.block_at(b.index());
    b.for_threads(cameras.size(),
                  [&](int t) { s.carving[t] = look(t, first, kBrick * kBlockBricks).inside ? 0U : 1U; });
    b.on_one_thread([&] {
      s.any = 0;
      for (Index d = 0; d < cameras.size(); ++d) s.any |= s.carving[d] << d;
      block_depth[b.index()] = s.any;
    });
    if (s.any == 0) return;
    b.for_each_thread([&](int t) {
      const Vec3i brick = first + Vec3i{t & 3, t >> 2 & 3, t >> 4};
      s.states.state[t] = grid.holds(brick) ? vote(brick, s.any) : 0U;
    });
    s.states.write(b, grid, first, tiles, tile_active);
  }

 private:
  /// Closed box of the nodes [8 brick, 8 brick + extent].
  TACTUS_HD Footprint look(Index camera, Vec3i brick, Index extent) const {
    const float half = 0.5F * static_cast<float>(extent);
    return classify_depth(cameras[camera], low.data(), high.data(),
                          vec_cast<float>(kBrick * brick) + Vec3f{half, half, half}, half);
  }

  /// The state of a brick with the vote.
  TACTUS_HD std::uint32_t vote(Vec3i brick, std::uint32_t candidates) const {
    const std::uint32_t before =
        tiles[grid.tile_of(brick)] >> HullGrid::bit_in_tile(brick) & (kActiveBit | kInsideBit);
    if (before == 0) return 0;
    std::uint32_t state = before;
    for (; candidates != 0; candidates &= candidates - 1) {
      const Footprint f = look(lowest_bit(candidates), brick, kBrick);
      if (f.outside) return 0;
      if (!f.inside) state = kActiveBit;
    }
    return state;
  }
};

/// Clears the signs of nodes in front of a measured surface.
struct DepthSigns {
  HullGrid grid;
  View<const DepthCamera> cameras;
  View<const float> carving, low, high;
  View<const Index> bricks;  ///< of each slot
  View<const std::uint32_t> block_depth;
  View<std::uint8_t> rows;        ///< in and out: as BrickSigns
  View<std::uint32_t> sub_depth;  ///< out: 8 per slot: depth cameras that carve within each 4^3 sub-brick

  static constexpr int kSubNodes = 64, kThreads = 8 * kSubNodes;
  struct Shared {
    std::uint32_t carving[kMaxDepthCameras], any;  ///< cameras that carve anything in the brick
    std::uint32_t sub_mixed[8], sub_outside[8];
    std::uint32_t inside[8][kSubNodes];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i brick = grid.brick_at(bricks[b.index()]), first = kBrick * brick;
    const std::uint32_t candidates = block_depth[grid.block_of(brick)];
    b.for_threads(cameras.size(), [&](int t) {
      s.carving[t] = (candidates >> t & 1U) != 0 && !look(t, first, 0.5F * kBrick).inside ? 1U : 0U;
    });
    b.on_one_thread([&] {
      s.any = 0;
      for (Index d = 0; d < cameras.size(); ++d) s.any |= s.carving[d] << d;
    });
    b.for_threads(8, [&](int t) { look_at_sub_brick(s, t, first, b.index() * 8 + t); });
    if (s.any == 0) return;
    carve(b, s, first, s.any);
    b.for_threads(kBrickRows, [&](int t) {
      const int y = t & 7, z = t >> 3, in_sub = (y & 3) * 4 + (z & 3) * 16;
      const std::uint32_t* left = s.inside[(y >> 2) * 2 + (z >> 2) * 4] + in_sub;
      const std::uint32_t* right = s.inside[(y >> 2) * 2 + (z >> 2) * 4 + 1] + in_sub;
      const std::uint32_t row = left[0] | left[1] << 1 | left[2] << 2 | left[3] << 3 | right[0] << 4 |
                                right[1] << 5 | right[2] << 6 | right[3] << 7;
      std::uint8_t& out = rows[b.index() * kBrickRows + t];
      out = static_cast<std::uint8_t>(out & row);
    });
  }

 private:
  TACTUS_HD static Vec3i sub_brick_node(int sub) {
    return {(sub & 1) * 4, (sub >> 1 & 1) * 4, (sub >> 2) * 4};
  }

  /// Closed box of the nodes [first, first + 2 half].
  TACTUS_HD Footprint look(Index camera, Vec3i first, float half) const {
    return classify_depth(cameras[camera], low.data(), high.data(),
                          vec_cast<float>(first) + Vec3f{half, half, half}, half);
  }

  TACTUS_HD void look_at_sub_brick(Shared& s, int sub, Vec3i first, Index out) const {
    std::uint32_t mixed = 0, outside = 0;
    for (std::uint32_t left = s.any; left != 0; left &= left - 1) {
      const int d = lowest_bit(left);
      const Footprint f = look(d, first + sub_brick_node(sub), 2.F);
      outside |= f.outside ? 1U : 0U;
      mixed |= f.inside ? 0U : 1U << d;
    }
    s.sub_outside[sub] = outside;
    s.sub_mixed[sub] = sub_depth[out] = outside != 0 ? 0U : mixed;
  }

  template <class Block>
  TACTUS_HD void carve(const Block& b, Shared& s, Vec3i first, std::uint32_t candidates) const {
    b.template for_groups<kSubNodes>(
        8, [](int) { return true; },
        [&](int sub, int t) { s.inside[sub][t] = s.sub_outside[sub] == 0 ? 1U : 0U; });
    for (Index d = 0; d < cameras.size(); ++d) {
      if ((candidates >> d & 1U) == 0) continue;
      const DepthCamera camera = cameras[d];
      const float* pixels = carving.data();
      b.template for_groups<kSubNodes>(
          8, [&](int sub) { return (s.sub_mixed[sub] >> d & 1U) != 0; },
          [&](int sub, int t) {
            const Vec3i node = first + sub_brick_node(sub) + Vec3i{t & 3, t >> 2 & 3, t >> 4};
            const float D_m = sample_depth_m(camera, pixels, vec_cast<float>(node));
            s.inside[sub][t] &= D_m >= 0 ? 1U : 0U;
          });
    }
  }
};

}  // namespace tactus
