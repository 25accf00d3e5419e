#pragma once
/// Space that fewer than `min_views` cameras look at is outside, independent of their masks. Which blocks
/// that concerns is known beforehand; in most rigs there are none.
#include "tactus/reconstruct/hull_kernels.h"

namespace tactus {

/// Which cameras look at points and boxes of nodes. A view is an image: its silhouette is not asked.
struct ViewCounter {
  View<const HullCamera> views;  ///< of silhouettes and of depth
  Index min_views;

  /// At least min_views cameras see the node: each decides as sample_silhouette does.
  TACTUS_HD bool is_seen(Vec3f node) const {
    Index seen = 0;
    for (Index c = 0; c < views.size(); ++c) {
      const HullCamera& v = views[c];
      const Vec3f h = project_node(v, node);
      const float z = h.z > 1e-6F ? h.z : 1.F, x = h.x + 0.5F * z, y = h.y + 0.5F * z;
      const bool in_view = (h.z > 1e-6F) & (x >= 0.F) & (y >= 0.F) &
                           (x <= static_cast<float>(v.width_px) * z) &
                           (y <= static_cast<float>(v.height_px) * z);
      seen += in_view ? 1 : 0;
    }
    return seen >= min_views;
  }

  /// Where images cut the closed box of nodes [first, first + extent]. A pyramid of view is convex, so its
  /// corners tell: all within is seen whole, all behind one side is not seen.
  struct Votes {
    Index whole, in_part;  ///< cameras that see all of it; at least some of it, perhaps
    TACTUS_HD bool is_all_seen(Index least) const { return whole >= least; }
    TACTUS_HD bool is_unseen(Index least) const { return whole + in_part < least; }
  };
  TACTUS_HD Votes ask(Vec3i first, Index extent) const {
    Votes votes{0, 0};
    for (Index c = 0; c < views.size(); ++c) {
      const HullCamera& v = views[c];
      Index behind[5] = {0, 0, 0, 0, 0};
      for (int k = 0; k < 8; ++k) {
        const Vec3i corner = first + extent * Vec3i{k & 1, k >> 1 & 1, k >> 2};
        const Vec3f h = project_node(v, vec_cast<float>(corner));
        const float x = h.x + 0.5F * h.z, y = h.y + 0.5F * h.z;
        behind[0] += h.z > 1e-6F ? 0 : 1;
        behind[1] += x >= 0.F ? 0 : 1;
        behind[2] += y >= 0.F ? 0 : 1;
        behind[3] += x <= static_cast<float>(v.width_px) * h.z ? 0 : 1;
        behind[4] += y <= static_cast<float>(v.height_px) * h.z ? 0 : 1;
      }
      Index most = 0, any = 0;
      for (const Index n : behind) {
        most = max(most, n);
        any += n;
      }
      votes.whole += any == 0 ? 1 : 0;
      votes.in_part += any != 0 && most < 8 ? 1 : 0;
    }
    return votes;
  }
};

/// Changes the states of bricks that ClassifyBricks sorted: outside where too few cameras look, active where
/// too few look at a part. One block is 4^3 bricks, of those that are listed.
struct VoteViews {
  HullGrid grid;
  ViewCounter counter;
  View<const Index> blocks;   ///< the blocks concerned
  View<std::uint32_t> tiles;  ///< in and out, as ClassifyBricks
  View<Index> tile_active;    ///< in and out

  static constexpr int kThreads = 64;
  struct Shared {
    BlockStates states;
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i first = kBlockBricks * grid.block_at(blocks[b.index()]);
    b.for_each_thread([&](int t) {
      const Vec3i brick = first + Vec3i{t & 3, t >> 2 & 3, t >> 4};
      s.states.state[t] = grid.holds(brick) ? vote(brick) : 0U;
    });
    s.states.write(b, grid, first, tiles, tile_active);
  }

 private:
  TACTUS_HD std::uint32_t vote(Vec3i brick) const {
    const std::uint32_t before =
        tiles[grid.tile_of(brick)] >> HullGrid::bit_in_tile(brick) & (kActiveBit | kInsideBit);
    if (before == 0) return 0;
    const ViewCounter::Votes votes = counter.ask(kBrick * brick, kBrick);
    if (votes.is_all_seen(counter.min_views)) return before;
    return votes.is_unseen(counter.min_views) ? 0U : kActiveBit;
  }
};

/// Clears the signs of nodes that too few cameras look at. One block is an active brick.
struct ClearUnseen {
  HullGrid grid;
  ViewCounter counter;
  View<const std::uint32_t> block_concerned;  ///< a bit per block
  View<const Index> bricks;                   ///< of each slot
  View<std::uint8_t> rows;                    ///< in and out: as BrickSigns

  static constexpr int kThreads = kBrickRows;
  struct Shared {};

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Vec3i brick = grid.brick_at(bricks[b.index()]);
    const Index block = grid.block_of(brick);
    if ((block_concerned[block >> 5] >> (block & 31) & 1U) == 0) return;
    b.for_each_thread([&](int t) {
      std::uint8_t& row = rows[b.index() * kBrickRows + t];
      std::uint32_t kept = 0;
      for (std::uint32_t left = row; left != 0; left &= left - 1) {
        const int x = lowest_bit(left);
        const Vec3i node = kBrick * brick + Vec3i{x, t & 7, t >> 3};
        kept |= counter.is_seen(vec_cast<float>(node)) ? 1U << x : 0U;
      }
      row = static_cast<std::uint8_t>(kept);
    });
  }
};

}  // namespace tactus
