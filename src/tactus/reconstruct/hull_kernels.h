#pragma once
/// Which nodes of the grid lie inside every silhouette, found coarse to fine: blocks of 32^3 nodes, bricks of
/// 8^3, sub-bricks of 4^3, nodes. Only bricks that may hold surface get memory, a slot; of all others two
/// bits are kept. [P, "Visual hull computation"]
#include "tactus/base/bits.h"
#include "tactus/compute/atomic.h"
#include "tactus/geom/camera/camera_bits.h"
#include "tactus/reconstruct/silhouette_kernels.h"

namespace tactus {

inline constexpr Index kBrick = 8;                    ///< nodes along the edge of a brick
inline constexpr Index kBrickRows = kBrick * kBrick;  ///< rows (z, y) of 8 nodes along x
inline constexpr Index kBlockBricks = 4;              ///< bricks along the edge of a block
inline constexpr Index kTileBricks = kBlockBricks * kBlockBricks;
inline constexpr Index kRegionBlocks = 4;  ///< blocks along the edge of a region
inline constexpr Index kBlocksOfRegion = kRegionBlocks * kRegionBlocks * kRegionBlocks;
inline constexpr Index kOutsideBrick = -1, kInsideBrick = -2;
inline constexpr int kMaxHullParts = 64;  ///< devices that share a hull

/// The padded grid. Nodes carry padded indices 0 .. cells+2: real node i is padded node i+1, and the padding
/// is outside by definition, so the surface closes at the box. A layer of a block is a *tile* of 4x4 bricks;
/// bricks are numbered by layers, then tiles, then within the tile, so that any range of layers is a range of
/// numbers.
struct HullGrid {
  Vec3i bricks;     ///< along each axis
  Vec3i blocks;     ///< along each axis
  Vec3i last_node;  ///< padding beyond the real nodes starts here: cells + 2
  TACTUS_HD Index block_count() const { return blocks.x * blocks.y * blocks.z; }
  TACTUS_HD Index layer_tiles() const { return blocks.x * blocks.y; }
  TACTUS_HD Index tile_count() const { return layer_tiles() * bricks.z; }
  TACTUS_HD Vec3i block_at(Index i) const {
    return {i % blocks.x, i / blocks.x % blocks.y, i / (blocks.x * blocks.y)};
  }
  TACTUS_HD Vec3i regions() const {
    return {ceil_div(blocks.x, kRegionBlocks), ceil_div(blocks.y, kRegionBlocks),
            ceil_div(blocks.z, kRegionBlocks)};
  }
  TACTUS_HD bool holds_block(Vec3i b) const { return b.x < blocks.x && b.y < blocks.y && b.z < blocks.z; }
  TACTUS_HD Index block_number(Vec3i b) const { return b.x + blocks.x * (b.y + blocks.y * b.z); }
  /// Block `i` of a region.
  TACTUS_HD Vec3i block_in_region(Index region, Index i) const {
    const Vec3i n = regions(), at{region % n.x, region / n.x % n.y, region / (n.x * n.y)};
    return kRegionBlocks * at + Vec3i{i & 3, i >> 2 & 3, i >> 4};
  }
  TACTUS_HD Index block_of(Vec3i brick) const {
    return (brick.x >> 2) + blocks.x * ((brick.y >> 2) + blocks.y * (brick.z >> 2));
  }
  TACTUS_HD Index tile_of(Vec3i brick) const {
    return (brick.x >> 2) + blocks.x * ((brick.y >> 2) + blocks.y * brick.z);
  }
  TACTUS_HD static int bit_in_tile(Vec3i brick) { return (brick.x & 3) | (brick.y & 3) << 2; }
  /// `number` is tile * kTileBricks + bit_in_tile.
  TACTUS_HD Vec3i brick_at(Index number) const {
    const Index tile = number / kTileBricks;
    return {tile % blocks.x * kBlockBricks + (number & 3),
            tile / blocks.x % blocks.y * kBlockBricks + (number >> 2 & 3), tile / layer_tiles()};
  }
  TACTUS_HD bool holds(Vec3i b) const { return b.x < bricks.x && b.y < bricks.y && b.z < bricks.z; }
};

/// Bits in the word of a tile for the brick with bit_in_tile 0: shifted for the others. Neither: outside.
inline constexpr std::uint32_t kActiveBit = 1, kInsideBit = 1U << kTileBricks;
TACTUS_HD inline Index active_in_tile(std::uint32_t word) { return popcount(word & (kInsideBit - 1)); }

/// Which active bricks a part of a device set works on, of all in the order of their numbers: an equal share,
/// and ghosts behind it. (Triangles use vertices of the neighbours above, whose numbering needs the signs of
/// theirs.)
struct PartRange {
  Index first = 0;        ///< active bricks of the parts before
  Index own = 0;          ///< this part's share
  Index counted = 0;      ///< those and the neighbours above, whose vertices are numbered here, too
  Index held = 0;         ///< those and their neighbours above: the slots in use, if there is capacity
  Index ghost_words = 0;  ///< words that the signs of all but the own ones fill
};

/// Words that the signs of a brick fill.
inline constexpr Index kSignWords = kBrickRows / 4;

/// Active bricks of the parts before `part`. Shares differ by one at most.
TACTUS_HD inline Index share_begin(Index all, Index part, Index parts) {
  return all / parts * part + min(part, all % parts);
}

/// Where bricks are.
struct BrickMap {
  HullGrid grid;
  View<const std::uint32_t> tiles;  ///< a word per tile
  View<const Index> tile_first;     ///< active bricks before each tile; all of them behind the last
  View<const PartRange> range;      ///< one
  Index capacity;                   ///< slots of this part
  /// kOutsideBrick, kInsideBrick or the slot. Bricks that this part doesn't hold are outside.
  TACTUS_HD Index slot_of(Vec3i brick) const {
    if (!grid.holds(brick)) return kOutsideBrick;
    const Index tile = grid.tile_of(brick);
    const std::uint32_t word = tiles[tile];
    const int bit = HullGrid::bit_in_tile(brick);
    if ((word >> bit & kActiveBit) == 0)
      return (word >> bit & kInsideBit) != 0 ? kInsideBrick : kOutsideBrick;
    const Index slot = tile_first[tile] + popcount(word & ((1U << bit) - 1U)) - range[0].first;
    return slot >= 0 && slot < min(range[0].held, capacity) ? slot : kOutsideBrick;
  }
};

/// States of the bricks of a block, written as the words of its four tiles.
struct BlockStates {
  std::uint32_t state[kBlockBricks * kTileBricks];  ///< kActiveBit, kInsideBit or 0

  template <class Block>
  TACTUS_HD void write(const Block& b, const HullGrid& grid, Vec3i first_brick, View<std::uint32_t> tiles,
                       View<Index> tile_active) const {
    b.for_threads(kBlockBricks, [&](int z) {
      if (first_brick.z + z >= grid.bricks.z) return;
      std::uint32_t word = 0;
      for (int i = 0; i < kTileBricks; ++i) word |= state[z * kTileBricks + i] << i;
      const Index tile = grid.tile_of(first_brick + Vec3i{0, 0, z});
      tiles[tile] = word;
      tile_active[tile] = active_in_tile(word);
    });
  }
};

/// Where cameras see a box of nodes, as many verdicts as cameras.
struct BoxVotes {
  std::uint32_t verdict[kMaxCameras];
  CameraBits mixed;  ///< cameras that don't see it all inside
  bool outside;      ///< more than `tolerated` cameras see it before background

  /// Closed box of the nodes [8 brick, 8 brick + extent].
  template <class Block>
  TACTUS_HD void ask(const Block& b, View<const HullCamera> cameras, View<const std::uint32_t> cells,
                     Vec3i brick, Index extent, Index tolerated) {
    const float half = 0.5F * static_cast<float>(extent);
    const Vec3f center = vec_cast<float>(kBrick * brick) + Vec3f{half, half, half};
    b.for_threads(cameras.size(), [&](int t) TACTUS_ALWAYS_INLINE {
      verdict[t] = classify_footprint(cameras[t], cells.data(), center, half);
    });
    b.on_one_thread([&] {
      Index against = 0;
      mixed = 0;
      for (Index c = 0; c < cameras.size(); ++c) {
        against += (verdict[c] & kOutsideFootprint) != 0 ? 1 : 0;
        mixed |= verdict[c] == kInsideFootprint ? CameraBits{0} : camera_bit(c);
      }
      outside = against > tolerated;
    });
  }
};

/// Sorts out the regions, 4^3 blocks, that are outside, most of a large grid: only blocks elsewhere
/// need to be looked at. One block is one region.
struct SortRegions {
  HullGrid grid;
  Index tolerated;
  View<const HullCamera> cameras;
  View<const std::uint32_t> cells;
  View<std::uint32_t> tiles;       ///< out, for outside regions: as ClassifyBricks
  View<CameraBits> block_cameras;  ///< likewise
  View<Index> tile_active;         ///< likewise
  View<Index> open_regions;        ///< out: the other regions, in any order
  View<Index> open_blocks;         ///< one; out: blocks of those, real or not; 0 before

  static constexpr int kThreads = 64;
  struct Shared {
    BoxVotes votes;
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i first = kBlockBricks * grid.block_in_region(b.index(), 0);
    s.votes.ask(b, cameras, cells, first, kBrick * kBlockBricks * kRegionBlocks, tolerated);
    b.on_one_thread([&] {
      if (b.index() == 0) tile_active[tile_active.size() - 1] = 0;
      if (s.votes.outside) return;
      auto& blocks = reinterpret_cast<std::uint32_t&>(open_blocks[0]);
      open_regions[static_cast<Index>(atomic_fetch_add(blocks, kBlocksOfRegion)) / kBlocksOfRegion] =
          b.index();
    });
    if (!s.votes.outside) return;
    b.for_threads(kBlocksOfRegion, [&](int i) {
      const Vec3i block = grid.block_in_region(b.index(), i);
      if (!grid.holds_block(block)) return;
      block_cameras[grid.block_number(block)] = 0;
      for (Index z = 0; z < kBlockBricks; ++z) {
        const Vec3i brick = kBlockBricks * block + Vec3i{0, 0, z};
        if (brick.z >= grid.bricks.z) return;
        tiles[grid.tile_of(brick)] = 0;
        tile_active[grid.tile_of(brick)] = 0;
      }
    });
  }
};

/// Sorts bricks into outside, inside and active. One block is 4^3 bricks. Space is outside where more than
/// `tolerated` cameras see background.
struct ClassifyBricks {
  HullGrid grid;
  Index tolerated;
  View<const HullCamera> cameras;
  View<const std::uint32_t> cells;
  View<std::uint32_t> tiles;       ///< out
  View<Index> tile_active;         ///< out: active bricks per tile, and a 0 behind the last
  View<CameraBits> block_cameras;  ///< out: cameras that carve within the block
  View<const Index> open_regions;  ///< regions whose blocks these are, 64 each; empty: all blocks

  static constexpr int kThreads = 64;
  struct Shared {
    BoxVotes votes;
    BlockStates states;
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i block = open_regions.empty() ? grid.block_at(b.index())
                                             : grid.block_in_region(open_regions[b.index() / kBlocksOfRegion],
                                                                    b.index() % kBlocksOfRegion);
    if (!grid.holds_block(block)) return;
    const Vec3i first = kBlockBricks * block;
    s.votes.ask(b, cameras, cells, first, kBrick * kBlockBricks, tolerated);
    b.on_one_thread([&] {
      block_cameras[grid.block_number(block)] = s.votes.outside ? CameraBits{0} : s.votes.mixed;
      if (b.index() == 0) tile_active[tile_active.size() - 1] = 0;
    });
    classify_bricks(b, s, first);
    s.states.write(b, grid, first, tiles, tile_active);
  }

 private:
  template <class Block>
  TACTUS_HD void classify_bricks(const Block& b, Shared& s, Vec3i first) const {
    typename Block::template PerThread<std::uint32_t> mixed, outside;
    const auto brick_of = [first](int t) { return first + Vec3i{t & 3, t >> 2 & 3, t >> 4}; };
    b.for_own(kThreads, [&](int t) {
      mixed[t] = 0;
      outside[t] = 0;
    });
    // Where the block is outside, so are its bricks, and no camera is left to ask.
    for (CameraBits left = s.votes.outside ? CameraBits{0} : s.votes.mixed; left != 0; left &= left - 1) {
      const int c = lowest_bit(left);
      const HullCamera camera = cameras[c];
      b.for_own(kThreads, [&](int t) TACTUS_ALWAYS_INLINE {
        constexpr float kHalf = 0.5F * kBrick;
        const std::uint32_t verdict = classify_footprint(
            camera, cells.data(), vec_cast<float>(kBrick * brick_of(t)) + Vec3f{kHalf, kHalf, kHalf}, kHalf);
        outside[t] += verdict / kOutsideFootprint;
        mixed[t] += (verdict & kInsideFootprint) ^ kInsideFootprint;
      });
    }
    const auto most = static_cast<std::uint32_t>(tolerated);
    b.for_each_thread([&](int t) {
      const Vec3i brick = brick_of(t), node = kBrick * brick;
      const bool at_padding = (min(node.x, min(node.y, node.z)) == 0) |
                              (node.x + kBrick >= grid.last_node.x) | (node.y + kBrick >= grid.last_node.y) |
                              (node.z + kBrick >= grid.last_node.z);
      const bool real = (brick.x < grid.bricks.x) & (brick.y < grid.bricks.y) & (brick.z < grid.bricks.z);
      const std::uint32_t kept = ((mixed[t] > most) | at_padding) ? kActiveBit : kInsideBit;
      s.states.state[t] = (real & !s.votes.outside & (outside[t] <= most)) ? kept : 0U;
    });
  }
};

/// Gives the active bricks of this part and those behind them their slots, and finds the part's range. One
/// call per tile.
struct AssignSlots {
  HullGrid grid;
  Index part, parts;
  View<const std::uint32_t> tiles;
  View<const Index> tile_first;
  View<Index> bricks;     ///< out: the number of the brick in each slot
  View<PartRange> range;  ///< out

  TACTUS_HD void operator()(Index tile) const {
    const Index all = tile_first[grid.tile_count()];
    const Index begin = share_begin(all, part, parts), end = share_begin(all, part + 1, parts);
    const Index first = tile_first[tile];
    Index slot = first - begin;
    for (std::uint32_t left = tiles[tile] & (kInsideBit - 1); left != 0 && slot < bricks.size();
         left &= left - 1) {
      if (slot >= 0) bricks[slot] = tile * kTileBricks + lowest_bit(left);
      ++slot;
    }
    // The tile of the last own brick knows how far its neighbours reach.
    const bool is_last = begin == end ? tile == 0 : first < end && end <= tile_first[tile + 1];
    if (is_last) range[0] = make_range(tile, begin, end);
  }

 private:
  TACTUS_HD PartRange make_range(Index last, Index begin, Index end) const {
    if (begin == end) return {begin, 0, 0, 0, 0};
    // Two bricks on along x or y lie in the next tile at most.
    const Index behind = last + grid.blocks.x + 2;
    const auto below = [&](Index tile) { return tile_first[min(tile, grid.tile_count())] - begin; };
    const Index own = end - begin, held = below(behind + 2 * grid.layer_tiles());
    return {begin, own, below(behind + grid.layer_tiles()), held,
            kSignWords * max(min(held, bricks.size()) - own, 0)};
  }
};

/// Copies the signs of the ghosts from the parts that own them. One call per word.
struct FetchGhosts {
  View<const std::uint32_t> rows[kMaxHullParts];  ///< of each part, in its own memory
  Index part, parts;
  View<const Index> tile_first;
  View<const PartRange> range;
  View<std::uint32_t> out;  ///< this part's

  TACTUS_HD void operator()(Index i) const {
    const Index all = tile_first[tile_first.size() - 1];
    const Index number = range[0].first + range[0].own + i / kSignWords;
    Index owner = part + 1;
    while (share_begin(all, owner + 1, parts) <= number) ++owner;
    const Index from = kSignWords * (number - share_begin(all, owner, parts)) + i % kSignWords;
    // Where the owner has no capacity there are no signs; the report says so.
    out[kSignWords * range[0].own + i] = from < rows[owner].size() ? rows[owner][from] : 0U;
  }
};

/// Signs of the 8^3 nodes of an active brick, a bit each: row (z, y), bit x; set is inside.
struct BrickSigns {
  HullGrid grid;
  View<const HullCamera> cameras;
  View<const std::uint32_t> cells, bits;
  View<const Index> bricks;  ///< of each slot
  View<const CameraBits> block_cameras;
  View<std::uint8_t> rows;       ///< out: kBrickRows per slot
  View<CameraBits> sub_cameras;  ///< out: 8 per slot: cameras that carve within each 4^3 sub-brick

  static constexpr int kSubNodes = 64, kThreads = 8 * kSubNodes, kLeastBlocks = 3;
  struct Shared {
    int camera[kMaxCameras];                ///< that carve in the block, ...
    int camera_count;                       ///< ... so many
    std::uint32_t verdict[kMaxCameras][8];  ///< of each of them on each sub-brick
    CameraBits sub_mixed[8];
    std::uint32_t sub_outside[8];
    std::uint32_t inside[8][kSubNodes];  ///< per sub-brick and node: 0 or 1
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i brick = grid.brick_at(bricks[b.index()]), first = kBrick * brick;
    find_sub_cameras(b, s, first, block_cameras[grid.block_of(brick)]);
    carve(b, s, first);
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
  TACTUS_HD void find_sub_cameras(const Block& b, Shared& s, Vec3i first, CameraBits candidates) const {
    b.on_one_thread([&] {
      int count = 0;
      for (CameraBits left = candidates; left != 0; left &= left - 1) s.camera[count++] = lowest_bit(left);
      s.camera_count = count;
    });
    b.template for_groups<8>(
        s.camera_count, [](int) { return true; },
        [&](int k, int t) TACTUS_ALWAYS_INLINE {
          s.verdict[k][t] =
              classify_footprint(cameras[s.camera[k]], cells.data(),
                                 vec_cast<float>(first + sub_brick_node(t)) + Vec3f{2, 2, 2}, 2.F);
        });
    b.for_threads(8, [&](int t) {
      CameraBits mixed = 0;
      std::uint32_t outside = 0;
      for (int k = 0; k < s.camera_count; ++k) {
        outside |= s.verdict[k][t] & kOutsideFootprint;
        mixed |= s.verdict[k][t] == 0 ? camera_bit(s.camera[k]) : 0;
      }
      s.sub_outside[t] = outside;
      // An outside sub-brick holds no crossing.
      s.sub_mixed[t] = sub_cameras[b.index() * 8 + t] = outside != 0 ? 0 : mixed;
    });
  }

  template <class Block>
  TACTUS_HD void carve(const Block& b, Shared& s, Vec3i first) const {
    const Vec3i last = grid.last_node;
    const auto node_of = [first](int sub, int t) {
      return first + sub_brick_node(sub) + Vec3i{t & 3, t >> 2 & 3, t >> 4};
    };
    b.template for_own_groups<kSubNodes>(
        8, [](int) { return true; },
        [&](int sub, int t) TACTUS_ALWAYS_INLINE {
          const Vec3i n = node_of(sub, t);
          const bool real =
              (n.x > 0) & (n.y > 0) & (n.z > 0) & (n.x < last.x) & (n.y < last.y) & (n.z < last.z);
          s.inside[sub][t] = (real & (s.sub_outside[sub] == 0)) ? 1U : 0U;
        });
    CameraBits any = 0;
    for (const CameraBits mixed : s.sub_mixed) any |= mixed;
    for (; any != 0; any &= any - 1) {
      const int c = lowest_bit(any);
      const HullCamera camera = cameras[c];
      const std::uint32_t* words = bits.data();
      b.template for_own_groups<kSubNodes>(
          8, [&](int sub) { return (s.sub_mixed[sub] & camera_bit(c)) != 0; },
          [&](int sub, int t) TACTUS_ALWAYS_INLINE {
            const float value =
                sample_silhouette(camera, words, project_node(camera, vec_cast<float>(node_of(sub, t))));
            s.inside[sub][t] &= value >= 0.F ? 1U : 0U;
          });
    }
    b.barrier();
  }
};

}  // namespace tactus
