#pragma once
/// Finds what the points of a body touch.
///
/// A point that is far from everything sleeps until it has moved, relative to each boundary, by what it is
/// away from it. A point that is near one keeps a list of its triangles, which holds until the point has
/// moved by more than the list's margin. Both are exact: a list is used only where no triangle outside of it
/// can matter, so what is found is what a search through all triangles would find.
#include "tactus/compute/fold.h"
#include "tactus/contact/contact_finder.h"

namespace tactus {

/// Block: points that sleep together. Lists those that may touch something.
struct WakePoints {
  static constexpr int kThreads = kBlockPoints, kGrain = 32;
  ContactFinder finder;
  PointBlocks blocks;
  Index first_block = 0;
  struct Shared {
    float node_moved2_m2[8 * kBlockPoints];
    float sleep_m[kBlockPoints];  ///< of those that were looked at; else < 0
  };
  TACTUS_HD void load() { finder.load(); }

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const TouchingPoints& body = finder.body;
    if (body.nodes.has_stopped()) return;
    const Index block = first_block + b.index(), first = blocks.points[block].begin,
                count = blocks.points[block].end - first;
    if (count == 0) return;  // room
    const float moved_m = block_moved_m(b, s, block);
    b.for_threads(count, [&](int t) {
      s.sleep_m[t] = -1;
      if (moved_m != kNever && moved_m < blocks.sleep_m[first + t]) return;
      PointQuery p;
      finder.begin(first + t, p);
      s.sleep_m[t] = p.sleep_m;
      if (p.now == PointQuery::Now::listed)
        body.state.awake.add(first + t);
      else if (p.now == PointQuery::Now::lost)
        body.state.lost.add(first + t);
      else
        finder.let_go(first + t);
    });
    fall_asleep(b, s, block, moved_m);
  }

 private:
  static constexpr float kNever = -1;
  /// How far a node of the block moved, at most, since the block was looked at; kNever: in this frame, it
  /// never was.
  template <class Block>
  TACTUS_HD float block_moved_m(const Block& b, Shared& s, Index block) const {
    const Index then = blocks.pose[block];
    if (then < 0) return kNever;
    const Index first = blocks.lists[block].begin, count = blocks.lists[block].end - first;
    const auto node_m = [&](int k) { return finder.body.nodes.position(blocks.nodes[first + k]); };
    if constexpr (Block::kIsLoop) {  // loops over nodes alone, for their lanes
      Vec3f x_m[8 * kBlockPoints];
      b.for_range(count, [&](int k) {
        x_m[k] = node_m(k);
        s.node_moved2_m2[k] = 0;
      });
      finder.for_each_owner(then, [&](auto&& seen_then, auto&& seen_now) {
        b.for_range(count, [&](int k) TACTUS_ALWAYS_INLINE {
          const Vec3f moved = seen_now(x_m[k]) - seen_then(blocks.x_m[first + k]);
          s.node_moved2_m2[k] = max(s.node_moved2_m2[k], dot(moved, moved));
        });
      });
      float most = 0;
      for (Index k = 0; k < count; ++k) most = max(most, s.node_moved2_m2[k]);
      return tactus::sqrt(most);
    } else {
      b.for_each_thread([&](int t) {
        float most = 0;
        for (int k = t; k < count; k += kThreads)
          most = max(most, finder.moved2_m2(blocks.x_m[first + k], then, node_m(k)));
        s.node_moved2_m2[t] = most;
      });
      fold<kThreads>(b, kThreads, [&](int t, int other) {
        s.node_moved2_m2[t] = max(s.node_moved2_m2[t], s.node_moved2_m2[other]);
      });
      return tactus::sqrt(s.node_moved2_m2[0]);
    }
  }
  /// Notes how far nodes may move, counted from where they are now if a point found new room.
  template <class Block>
  TACTUS_HD void fall_asleep(const Block& b, const Shared& s, Index block, float moved_m) const {
    const Index first = blocks.points[block].begin, count = blocks.points[block].end - first;
    bool has_room = false, any = false;
    for (int t = 0; t < count; ++t) {
      any = any || s.sleep_m[t] >= 0.F;
      has_room = has_room || s.sleep_m[t] > 0.F;
    }
    if (!any) return;
    b.for_own(count, [&](int t) {
      if (s.sleep_m[t] >= 0.F)
        blocks.sleep_m[first + t] = s.sleep_m[t];
      else if (has_room)
        blocks.sleep_m[first + t] -= moved_m;
    });
    if (!has_room) return;
    b.on_one_thread([&] { blocks.pose[block] = finder.pose; });
    const Index first_node = blocks.lists[block].begin;
    b.for_range(blocks.lists[block].end - first_node, [&](int k) {
      blocks.x_m[first_node + k] = finder.body.nodes.position(blocks.nodes[first_node + k]);
    });
  }
};

/// What a block that works on one point shares.
class FoundPoint {
 public:
  SurfaceTrianglesView surface;
  PointQuery point;
  ListedTriangle list[kNearTriangles];
  std::uint32_t deciding[kListWords];
  LeastOfTriangles least[kOwners];
  TACTUS_HD void begin(const ContactFinder& finder, Index i) {
    surface = finder.boundaries.surface;
    point.list = list;
    point.deciding = deciding;
    finder.begin(i, point);
  }
  /// One thread looks at what may decide, so a GPU's lanes leave it few. On a CPU, which has one lane, that
  /// would be for nothing.
  template <class Block>
  TACTUS_HD void see_list(const Block& b, const ContactFinder& finder, Index i) {
    const Index count = point.near.count;
    if constexpr (Block::kIsLoop) {
      b.for_range(count, [&](int e) { finder.see(i, e, surface, point); });
      for (Index word = 0; word < kListWords; ++word) deciding[word] = 0;
      for (Index e = 0; e < count; ++e) deciding[e / kListBits] |= bit(e);
    } else {
      const float reach2_m2 = sqr(finder.body.reach_m);
      b.for_range(kOwners, [&](int owner) { least[owner] = {}; });
      b.for_range(count, [&](int e) {
        finder.see(i, e, surface, point);
        least[list[e].near.owner].see(list[e].seen, reach2_m2);
      });
      b.for_range(kListWords, [&](int word) { deciding[word] = 0; });
      b.for_range(count, [&](int e) {
        if (least[list[e].near.owner].may_decide(list[e].seen, reach2_m2))
          atomic_or(deciding[e / kListBits], bit(e));
      });
    }
  }

 private:
  TACTUS_HD static std::uint32_t bit(Index e) { return 1U << static_cast<unsigned>(e % kListBits); }
};

/// Block: a point that is awake and has a list. Notes those whose list turns out to be too short.
struct FindContacts {
  static constexpr int kThreads = 32, kGrain = 16;
  ContactFinder finder;
  struct Shared {
    FoundPoint found;
  };
  TACTUS_HD void load() { finder.load(); }

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index i = finder.body.state.awake.points[b.index()];
    b.on_one_thread([&] { s.found.begin(finder, i); });
    s.found.see_list(b, finder, i);
    b.on_one_thread([&] {
      finder.conclude(i, s.found.surface, true, s.found.point);
      if (s.found.point.now == PointQuery::Now::lost) finder.body.state.lost.add(i);
      if (s.found.point.now == PointQuery::Now::nothing) finder.let_go(i);
    });
  }
};

/// Block: a point whose list is of no use. Searches round it, on a GPU by many threads: all points wait for
/// the slowest.
struct SearchContacts {
  static constexpr int kThreads = TriangleSearch::kLanes, kGrain = 4;
  static constexpr bool kLoadsTogether = true;
  ContactFinder finder;
  struct Shared {
    FoundPoint found;
    TriangleSearch search;
  };
  TACTUS_HD void load() { finder.load(); }

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index i = finder.body.state.lost.points[b.index()];
    PointQuery& p = s.found.point;
    b.on_one_thread([&] {
      s.found.begin(finder, i);
      if (p.now == PointQuery::Now::listed) finder.lose(p);
    });
    // Where the new list is too short, a GPU's lanes look for the gap together.
    constexpr int kRounds = Block::kIsLoop ? 1 : 2;
    for (int round = 0; round < kRounds; ++round) {
      const bool is_lost = p.now == PointQuery::Now::lost;
      b.barrier();  // the search may say something else at once
      if (!is_lost) break;
      finder.search(b, i, s.found.surface, p, s.search, round == 0);
      if (p.now != PointQuery::Now::listed) break;
      s.found.see_list(b, finder, i);
      b.on_one_thread([&] { finder.conclude(i, s.found.surface, round + 1 < kRounds, p); });
    }
    b.on_one_thread([&] {
      if (p.now == PointQuery::Now::nothing) finder.let_go(i);
    });
  }
};

}  // namespace tactus
