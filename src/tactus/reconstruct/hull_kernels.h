#pragma once
/// Which nodes of the grid lie inside every silhouette, found coarse to fine: blocks of 32^3 nodes, bricks of
/// 8^3, sub-bricks of 4^3, nodes. Only bricks that may hold surface get memory. [P, "Visual hull
/// computation"]
#include "tactus/base/bits.h"
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

/// Sorts bricks into outside, inside and active. One block is 4^3 bricks. Outside is what more than
/// `tolerated` cameras see before background.
struct ClassifyBricks {
  HullGrid grid;
  Index tolerated;
  Vec3i blocks;  ///< of this part
  View<const HullCamera> cameras;
  View<const std::uint32_t> cells;
  View<Index> active;                 ///< out: 1 for bricks that may hold surface
  View<Index> slot;                   ///< out: kOutsideBrick or kInsideBrick; active ones get theirs later
  View<std::uint32_t> brick_cameras;  ///< out: bit c set: camera c carves within the brick

  static constexpr int kThreads = 64;
  struct Shared {
    std::uint32_t verdict[kMaxCameras];  ///< of the whole block: 0 mixed, 1 inside, 2 outside
    std::uint32_t mixed;
    bool outside;
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i block{b.index() % blocks.x, b.index() / blocks.x % blocks.y,
                      b.index() / (blocks.x * blocks.y)};
    const Vec3i first{block.x * kBlockBricks, block.y * kBlockBricks,
                      block.z * kBlockBricks + grid.layer_begin};
    b.for_threads(cameras.size(), [&](int t) {
      const Footprint f = look(cameras[t], first, kBrick * kBlockBricks);
      s.verdict[t] = f.outside ? 2U : (f.inside ? 1U : 0U);
    });
    b.on_one_thread([&] {
      s.mixed = 0;
      Index outside = 0;
      for (Index c = 0; c < cameras.size(); ++c) {
        outside += s.verdict[c] == 2 ? 1 : 0;
        s.mixed |= s.verdict[c] == 1 ? 0U : 1U << c;
      }
      s.outside = outside > tolerated;
    });
    classify_bricks(b, s, first);
  }

  /// Closed box of the nodes [8 brick, 8 brick + extent].
  TACTUS_HD Footprint look(const HullCamera& camera, Vec3i brick, Index extent) const {
    const float half = 0.5F * static_cast<float>(extent);
    return classify_footprint(camera, cells.data(), vec_cast<float>(kBrick * brick) + Vec3f{half, half, half},
                              half);
  }

  template <class Block>
  TACTUS_HD void classify_bricks(const Block& b, const Shared& s, Vec3i first) const {
    typename Block::template PerThread<std::uint32_t> mixed, outside;
    const auto brick_of = [first](int t) { return first + Vec3i{t & 3, t >> 2 & 3, t >> 4}; };
    b.for_each_thread([&](int t) {
      mixed[t] = 0;
      outside[t] = s.outside ? ~0U : 0U;
    });
    const auto most = static_cast<std::uint32_t>(tolerated);
    for (Index c = 0; c < cameras.size() && !s.outside; ++c) {
      if ((s.mixed >> c & 1U) == 0) continue;
      const HullCamera camera = cameras[c];
      b.for_each_thread([&](int t) {
        const Footprint f = look(camera, brick_of(t), kBrick);
        outside[t] += f.outside ? 1U : 0U;
        mixed[t] |= f.inside ? 0U : 1U << c;
      });
    }
    b.for_each_thread([&](int t) {
      const Vec3i brick = brick_of(t), node = kBrick * brick;
      if (!grid.holds(brick)) return;
      const bool at_padding = min(node.x, min(node.y, node.z)) == 0 || node.x + kBrick >= grid.last_node.x ||
                              node.y + kBrick >= grid.last_node.y || node.z + kBrick >= grid.last_node.z;
      const Index i = grid.brick_index(brick);
      const bool is_mixed = most == 0 ? mixed[t] != 0 : popcount(mixed[t]) > tolerated;
      active[i] = outside[t] <= most && (is_mixed || at_padding) ? 1 : 0;
      slot[i] = outside[t] > most ? kOutsideBrick : kInsideBrick;
      brick_cameras[i] = mixed[t];
    });
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

  static constexpr int kSubNodes = 64, kThreads = 8 * kSubNodes;
  struct Shared {
    std::uint32_t sub_mixed[8], sub_outside[8];
    std::uint32_t inside[8][kSubNodes];  ///< per sub-brick and node: 0 or 1
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index brick = active_bricks[b.index()];
    const Vec3i first = kBrick * grid.brick_at(brick);
    find_sub_cameras(b, s, first, brick_cameras[brick]);
    carve(b, s, first, brick_cameras[brick]);
    b.for_threads(kBrickRows, [&](int t) {
      const int y = t & 7, z = t >> 3, in_sub = (y & 3) * 4 + (z & 3) * 16;
      const std::uint32_t* low = s.inside[(y >> 2) * 2 + (z >> 2) * 4] + in_sub;
      const std::uint32_t* high = s.inside[(y >> 2) * 2 + (z >> 2) * 4 + 1] + in_sub;
      const std::uint32_t row = low[0] | low[1] << 1 | low[2] << 2 | low[3] << 3 | high[0] << 4 |
                                high[1] << 5 | high[2] << 6 | high[3] << 7;
      rows[b.index() * kBrickRows + t] = static_cast<std::uint8_t>(row);
    });
  }

 private:
  TACTUS_HD static Vec3i sub_brick_node(int sub) {
    return {(sub & 1) * 4, (sub >> 1 & 1) * 4, (sub >> 2) * 4};
  }

  template <class Block>
  TACTUS_HD void find_sub_cameras(const Block& b, Shared& s, Vec3i first, std::uint32_t candidates) const {
    b.for_threads(8, [&](int t) { s.sub_mixed[t] = s.sub_outside[t] = 0; });
    for (Index c = 0; c < cameras.size(); ++c) {
      if ((candidates >> c & 1U) == 0) continue;
      const HullCamera camera = cameras[c];
      b.for_threads(8, [&](int t) {
        const Footprint f = classify_footprint(
            camera, cells.data(), vec_cast<float>(first + sub_brick_node(t)) + Vec3f{2, 2, 2}, 2.F);
        s.sub_mixed[t] |= f.inside ? 0U : 1U << c;
        s.sub_outside[t] |= f.outside ? 1U : 0U;
      });
    }
    // An outside sub-brick holds no crossing.
    b.for_threads(8, [&](int t) {
      s.sub_mixed[t] = s.sub_outside[t] != 0 ? 0U : s.sub_mixed[t];
      sub_cameras[b.index() * 8 + t] = s.sub_mixed[t];
    });
  }

  template <class Block>
  TACTUS_HD void carve(const Block& b, Shared& s, Vec3i first, std::uint32_t candidates) const {
    const Vec3i last = grid.last_node;
    const auto node_of = [first](int sub, int t) {
      return first + sub_brick_node(sub) + Vec3i{t & 3, t >> 2 & 3, t >> 4};
    };
    b.template for_groups<kSubNodes>(
        8, [](int) { return true; },
        [&](int sub, int t) {
          const Vec3i n = node_of(sub, t);
          const bool real =
              (n.x > 0) & (n.y > 0) & (n.z > 0) & (n.x < last.x) & (n.y < last.y) & (n.z < last.z);
          s.inside[sub][t] = (real & (s.sub_outside[sub] == 0)) ? 1U : 0U;
        });
    for (Index c = 0; c < cameras.size(); ++c) {
      if ((candidates >> c & 1U) == 0) continue;
      const HullCamera camera = cameras[c];
      const std::uint32_t* words = bits.data();
      b.template for_groups<kSubNodes>(
          8, [&](int sub) { return (s.sub_mixed[sub] >> c & 1U) != 0; },
          [&](int sub, int t) {
            const float value =
                sample_silhouette(camera, words, project_node(camera, vec_cast<float>(node_of(sub, t))));
            s.inside[sub][t] &= value >= 0.F ? 1U : 0U;
          });
    }
  }
};

}  // namespace tactus
