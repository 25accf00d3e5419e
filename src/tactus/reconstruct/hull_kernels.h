#pragma once
/// Which nodes of the grid lie inside every silhouette, found coarse to fine: blocks of 32^3 nodes, bricks of
/// 8^3, sub-bricks of 4^3, nodes. Only bricks that may hold surface get memory. [P, "Visual hull
/// computation"]
#include "tactus/reconstruct/silhouette_kernels.h"

namespace tactus {

inline constexpr Index kBrick = 8;                    ///< nodes along the edge of a brick
inline constexpr Index kBrickRows = kBrick * kBrick;  ///< rows (z, y) of 8 nodes along x
inline constexpr Index kBlockBricks = 4;              ///< bricks along the edge of a block
inline constexpr Index kOutsideBrick = -1, kInsideBrick = -2;
inline constexpr int kMaxCameras = 32;

/// The padded grid, and which layers of bricks this part of it holds. Nodes carry padded indices 0 ..
/// cells+2: real node i is padded node i+1, and the padding is outside by definition, so the surface closes
/// at the box.
struct HullGrid {
  Vec3i bricks;                  ///< of the whole grid
  Vec3i last_node;               ///< padding beyond the real nodes starts here: cells + 2
  Index layer_begin, layer_end;  ///< brick layers in memory (own and ghosts)
  TACTUS_HD Index brick_count() const { return bricks.x * bricks.y * (layer_end - layer_begin); }
  TACTUS_HD Index brick_index(Vec3i b) const {
    return b.x + bricks.x * (b.y + bricks.y * (b.z - layer_begin));
  }
  TACTUS_HD Vec3i brick_at(Index i) const {
    return {i % bricks.x, i / bricks.x % bricks.y, i / (bricks.x * bricks.y) + layer_begin};
  }
  TACTUS_HD bool holds(Vec3i b) const { return b.x < bricks.x && b.y < bricks.y && b.z < layer_end; }
};

/// Sorts bricks into outside, inside and active. One block is 4^3 bricks.
struct ClassifyBricks {
  HullGrid grid;
  Vec3i blocks;  ///< of this part
  View<const HullCamera> cameras;
  View<const std::uint32_t> cells;
  View<Index> active;                 ///< out: 1 for bricks that may hold surface
  View<Index> slot;                   ///< out: kOutsideBrick or kInsideBrick; active ones get theirs later
  View<std::uint32_t> brick_cameras;  ///< out: bit c set: camera c carves within the brick

  static constexpr int kThreads = 64;
  struct Shared {
    Footprint verdict[kMaxCameras];
    std::uint32_t mixed;
    bool outside;
  };

  /// Closed box of the nodes [first, first + extent].
  TACTUS_HD Footprint look(Index camera, Vec3i first, Index extent) const {
    const float half = 0.5F * static_cast<float>(extent);
    return classify_footprint(cameras[camera], cells.data(), vec_cast<float>(first) + Vec3f{half, half, half},
                              {half, half, half});
  }

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i block{b.index() % blocks.x, b.index() / blocks.x % blocks.y,
                      b.index() / (blocks.x * blocks.y)};
    const Vec3i first{block.x * kBlockBricks, block.y * kBlockBricks,
                      block.z * kBlockBricks + grid.layer_begin};
    b.for_each_thread([&](int t) {
      if (t < cameras.size()) s.verdict[t] = look(t, kBrick * first, kBrick * kBlockBricks);
    });
    b.for_each_thread([&](int t) {
      if (t != 0) return;
      s.mixed = 0;
      s.outside = false;
      for (Index c = 0; c < cameras.size(); ++c) {
        s.outside = s.outside || s.verdict[c] == Footprint::outside;
        s.mixed |= s.verdict[c] == Footprint::mixed ? 1U << c : 0U;
      }
    });
    b.for_each_thread([&](int t) {
      const Vec3i brick = first + Vec3i{t & 3, t >> 2 & 3, t >> 4};
      if (grid.holds(brick)) classify_brick(brick, s.outside, s.mixed);
    });
  }

  TACTUS_HD void classify_brick(Vec3i brick, bool outside, std::uint32_t candidates) const {
    const Vec3i node = kBrick * brick;
    std::uint32_t mixed = 0;
    for (Index c = 0; c < cameras.size() && !outside; ++c) {
      if ((candidates >> c & 1U) == 0) continue;
      const Footprint f = look(c, node, kBrick);
      outside = f == Footprint::outside;
      mixed |= f == Footprint::mixed ? 1U << c : 0U;
    }
    const bool at_padding = node.x == 0 || node.y == 0 || node.z == 0 ||
                            node.x + kBrick >= grid.last_node.x || node.y + kBrick >= grid.last_node.y ||
                            node.z + kBrick >= grid.last_node.z;
    const bool is_active = !outside && (mixed != 0 || at_padding);
    const Index i = grid.brick_index(brick);
    active[i] = is_active ? 1 : 0;
    slot[i] = outside ? kOutsideBrick : kInsideBrick;
    brick_cameras[i] = mixed;
  }
};

/// Gives every active brick its slot; counts those of the own layers.
struct AssignSlots {
  HullGrid grid;
  Index own_layer_end;
  Index capacity;  ///< of slots
  View<const Index> active_bricks, active_count;
  View<Index> slot;
  View<Index> own_count;  ///< out: active bricks below own_layer_end (they come first)
  TACTUS_HD void operator()(Index i) const {
    slot[active_bricks[i]] = i;
    const auto is_own = [&](Index k) { return grid.brick_at(active_bricks[k]).z < own_layer_end; };
    if (is_own(i) && (i + 1 == min(active_count[0], capacity) || !is_own(i + 1))) own_count[0] = i + 1;
  }
};

/// Signs of the 8^3 nodes of an active brick, a bit each: row (z, y), bit x; set is inside.
struct BrickSigns {
  HullGrid grid;
  View<const HullCamera> cameras;
  View<const std::uint32_t> cells, bits;
  View<const Index> active_bricks;
  View<const std::uint32_t> brick_cameras;
  View<std::uint8_t> rows;          ///< out: kBrickRows per slot
  View<std::uint32_t> sub_cameras;  ///< out: 8 per slot: cameras that carve within each 4^3 sub-brick

  static constexpr int kThreads = 64;
  struct Shared {
    std::uint32_t mixed[64], outside[64];
    std::uint32_t sub_mixed[8];
    std::uint32_t inside[8][64];  ///< per sub-brick and node: 0 or 1
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index brick = active_bricks[b.index()];
    const Vec3i first = kBrick * grid.brick_at(brick);
    find_sub_cameras(b, s, first, brick_cameras[brick]);
    for (int sub = 0; sub < 8; ++sub)
      carve_sub_brick(b, s, first + Vec3i{(sub & 1) * 4, (sub >> 1 & 1) * 4, (sub >> 2) * 4}, sub);
    b.for_each_thread([&](int t) {
      const int y = t & 7, z = t >> 3, in_sub = (y & 3) * 4 + (z & 3) * 16;
      const std::uint32_t* low = s.inside[(y >> 2) * 2 + (z >> 2) * 4] + in_sub;
      const std::uint32_t* high = s.inside[(y >> 2) * 2 + (z >> 2) * 4 + 1] + in_sub;
      std::uint32_t row = 0;
      for (int x = 0; x < 4; ++x) row |= low[x] << x | high[x] << (x + 4);
      rows[b.index() * kBrickRows + t] = static_cast<std::uint8_t>(row);
    });
  }

 private:
  template <class Block>
  TACTUS_HD void find_sub_cameras(const Block& b, Shared& s, Vec3i first, std::uint32_t candidates) const {
    // Eight threads share the cameras of one sub-brick.
    b.for_each_thread([&](int t) {
      const int sub = t >> 3;
      const Vec3f center =
          vec_cast<float>(first + Vec3i{(sub & 1) * 4, (sub >> 1 & 1) * 4, (sub >> 2) * 4}) + Vec3f{2, 2, 2};
      std::uint32_t mixed = 0, outside = 0;
      for (Index c = t & 7; c < cameras.size(); c += 8) {
        if ((candidates >> c & 1U) == 0) continue;
        const Footprint f = classify_footprint(cameras[c], cells.data(), center, {2, 2, 2});
        mixed |= f == Footprint::mixed ? 1U << c : 0U;
        outside |= f == Footprint::outside ? 1U : 0U;
      }
      s.mixed[t] = mixed;
      s.outside[t] = outside;
    });
    b.for_each_thread([&](int t) {
      if (t >= 8) return;
      std::uint32_t mixed = 0, outside = 0;
      for (int k = 8 * t; k < 8 * t + 8; ++k) {
        mixed |= s.mixed[k];
        outside |= s.outside[k];
      }
      // An outside sub-brick holds no crossing; any inside flag of its nodes is overruled below.
      s.sub_mixed[t] = outside != 0 ? 0U : mixed;
      s.outside[t] = outside;
      sub_cameras[b.index() * 8 + t] = s.sub_mixed[t];
    });
  }

  template <class Block>
  TACTUS_HD void carve_sub_brick(const Block& b, Shared& s, Vec3i first, int sub) const {
    const std::uint32_t start = s.outside[sub] != 0 ? 0U : 1U;
    const Vec3i last = grid.last_node;
    b.for_each_thread([&](int t) {
      const Index x = first.x + (t & 3), y = first.y + (t >> 2 & 3), z = first.z + (t >> 4);
      const bool real = (x > 0) & (y > 0) & (z > 0) & (x < last.x) & (y < last.y) & (z < last.z);
      s.inside[sub][t] = real ? start : 0U;
    });
    for (Index c = 0; c < cameras.size(); ++c) {
      if ((s.sub_mixed[sub] >> c & 1U) == 0) continue;
      const HullCamera camera = cameras[c];
      const std::uint32_t* words = bits.data();
      b.for_each_thread([&](int t) {
        const Vec3f node{static_cast<float>(first.x + (t & 3)), static_cast<float>(first.y + (t >> 2 & 3)),
                         static_cast<float>(first.z + (t >> 4))};
        const float value = sample_silhouette(camera, words, project_node(camera, node));
        s.inside[sub][t] &= value >= 0.F ? 1U : 0U;
      });
    }
  }
};

}  // namespace tactus
