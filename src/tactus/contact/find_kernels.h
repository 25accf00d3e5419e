#pragma once
/// Finds the contacts of the points of a body.
///
/// A point that is far from everything sleeps until it has moved, relative to each boundary, by its distance
/// from it. A point that is near one keeps a list of its triangles, which holds until the point has moved by
/// more than the list's margin. Both are exact: a list is used only where no triangle outside of it can
/// matter, so the result is that of a search through all triangles.
#include "tactus/compute/fold.h"
#include "tactus/contact/contact_finder.h"

namespace tactus {

/// Block: points that sleep together. Lists those that may touch something.
struct WakePoints {
  static constexpr int kThreads = kBlockPoints, kGrain = 32;
  ContactFinder of_all;
  PointBlocks blocks;
  struct Shared {
    float node_moved2_m2[kThreads];  ///< the most of each thread's
    float sleep_m[kBlockPoints];     ///< of those that were looked at; else < 0
  };
  TACTUS_HD void load() { of_all.load(); }

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const TouchingPoints& body = of_all.body;
    const Index block = blocks.used[b.index()];
    // A GPU waits for these together.
    const IndexRange points = blocks.points[block], nodes = blocks.lists[block];
    const Index then = blocks.pose[block], first = points.begin, count = points.end - first;
    if (body.nodes.has_stopped()) {
      if (begins_frame<Block>()) forget(block);
      return;
    }
    if (count == 0) return;  // capacity
    ContactFinder finder = of_all;
    finder.turn_to(first);
    float moved_m = block_moved_m(b, s, finder, nodes, then), rounding_m = 0;
    const bool renews = begins_frame<Block>();
    if (renews) rounding_m = renew(finder, block, moved_m);
    if (Block::kIsLoop && moved_m != kNever && moved_m < least_sleep_m(first, count)) return;
    b.for_threads(count, [&](int t) {
      s.sleep_m[t] = -1;
      if (moved_m != kNever && moved_m < blocks.sleep_m[first + t]) return;
      PointQuery p;
      finder.begin(first + t, p);
      if (renews) renew(finder, first + t, rounding_m, p);
      s.sleep_m[t] = p.sleep_m;
      if (p.now == PointQuery::Now::listed)
        body.state.awake.add(first + t);
      else if (p.now == PointQuery::Now::lost)
        body.state.awake.add(~(first + t));
      else
        finder.invalidate(first + t);
    });
    fall_asleep(b, s, finder, block, moved_m);
  }

 private:
  static constexpr float kNever = -1, kFar_m = 1e20F;
  /// Whether the results of searches in the frame before have to be carried over. A GPU, whose recorded
  /// frames can't tell whether the surface is a new one, searches in every frame.
  template <class Block>
  TACTUS_HD bool begins_frame() const {
    if constexpr (Block::kIsLoop)
      return of_all.now.substep == 0;
    else
      return false;
  }
  /// Nothing is known of its points.
  TACTUS_HD void forget(Index block) const {
    blocks.pose[block] = -1;
    for (Index i = blocks.points[block].begin; i < blocks.points[block].end; ++i)
      of_all.body.state.searched[i] = -1;
  }
  /// Points sleep on from the frame before, where they did: their distances count from where nodes are now,
  /// as that frame's poses are gone soon. Returns by how much distances are rounded.
  TACTUS_HD float renew(const ContactFinder& finder, Index block, float& moved_m) const {
    const TouchingPoints& body = finder.body;
    const IndexRange points = blocks.points[block], list = blocks.lists[block];
    const Vec3f at = list.begin < list.end ? body.nodes.position(blocks.nodes[list.begin]) : Vec3f{};
    const float rounding_m = kRounding * (abs(at.x) + abs(at.y) + abs(at.z) + body.margin_m),
                far_m = farthest_m(moved_m, rounding_m);
    const bool may_sleep = moved_m >= 0.F && moved_m < kFar_m;
    for (Index i = points.begin; i < points.end; ++i) {
      const float sleep_m = may_sleep && body.state.touching[i] == 0 ? blocks.sleep_m[i] - far_m : 0.F;
      blocks.sleep_m[i] = sleep_m;
      // Points that sleep are looked at anew when they wake, and those that are near shapes, always.
      if (sleep_m > 0.F || body.state.neighbours[i].listed_m >= kFar_m) body.state.searched[i] = -1;
    }
    moved_m = may_sleep ? 0 : kNever;
    if (!may_sleep) return rounding_m;
    blocks.pose[block] = finder.pose;
    for (Index k = list.begin; k < list.end; ++k) blocks.x_m[k] = body.nodes.position(blocks.nodes[k]);
    return rounding_m;
  }
  /// The list of a point likewise. By the triangle inequality, what was farther than it reaches is farther
  /// than the rest of it.
  TACTUS_HD static void renew(const ContactFinder& finder, Index i, float rounding_m, PointQuery& p) {
    const PointState& state = finder.body.state;
    if (p.now == PointQuery::Now::lost || state.searched[i] == finder.pose) return;
    state.searched[i] = -1;
    if (p.now != PointQuery::Now::listed) return;
    PointNeighbours near = state.neighbours[i];
    const float moved_m = farthest_m(p.moved_m, rounding_m);
    // Beyond, triangles of the cells round where the point is now may be missing.
    for (std::uint32_t left = near.colliders; left != 0U; left &= left - 1U) {
      const Index collider = static_cast<Index>(lowest_bit(left)), k = collider - kComponents;
      near.listed_m = min(near.listed_m, k < 0 ? finder.boundaries.surface.sure_reach_m()
                                               : finder.boundaries.obstacles[k].mesh.sure_reach_m());
    }
    near.listed_m -= moved_m;
    near.free_m -= moved_m;
    if (!(near.listed_m > 0.F && near.free_m > 0.F)) {
      p.now = PointQuery::Now::lost;
      return;
    }
    near.x_m = p.x_m;
    near.moved_m = p.moved_m = 0;
    state.neighbours[i] = near;
    state.searched[i] = finder.pose;
  }
  /// No less than a distance that was found to be moved_m.
  TACTUS_HD static float farthest_m(float moved_m, float rounding_m) {
    return 1.0001F * moved_m + rounding_m;
  }
  static constexpr float kRounding = 1.F / (1 << 20);  ///< of a position that is computed from others
  /// Where a block's nodes are, for a CPU's lanes.
  struct BlockNodes {
    float x[8 * kBlockPoints], y[8 * kBlockPoints], z[8 * kBlockPoints];
    /// How far the farthest moved as one collider sees it, squared.
    template <class T, class N>
    TACTUS_HD float moved2_m2(const Vec3f* x_then_m, Index count, const T& seen_then,
                              const N& seen_now) const {
      // A variable that is declared in a loop with lanes would be an array.
      const auto of_node = [&](Index k) TACTUS_ALWAYS_INLINE {
        const Vec3f moved = seen_now(Vec3f{x[k], y[k], z[k]}) - seen_then(x_then_m[k]);
        return dot(moved, moved);
      };
      float most = 0;
#pragma omp simd reduction(max : most)
      for (Index k = 0; k < count; ++k) most = max(most, of_node(k));
      return most;
    }
  };
  TACTUS_HD float least_sleep_m(Index first, Index count) const {
    float least = 1e30F;
#pragma omp simd reduction(min : least)
    for (Index i = first; i < first + count; ++i) least = min(least, blocks.sleep_m[i]);
    return least;
  }
  /// How far a node of a block's list moved, at most, since the block was looked at, at the pose `then`;
  /// kNever: in this frame, it never was.
  template <class Block>
  TACTUS_HD float block_moved_m(const Block& b, Shared& s, const ContactFinder& finder, IndexRange list,
                                Index then) const {
    if (then < 0) return kNever;
    const Index first = list.begin, count = list.end - first;
    const auto node_m = [&](int k) { return finder.body.nodes.position(blocks.nodes[first + k]); };
    if constexpr (Block::kIsLoop) {  // loops over nodes alone, for their lanes
      BlockNodes now;
      for (Index k = 0; k < count; ++k) {
        const Vec3f p = node_m(k);
        now.x[k] = p.x, now.y[k] = p.y, now.z[k] = p.z;
      }
      float most = 0;
      finder.for_each_collider(then, [&](auto&& seen_then, auto&& seen_now) {
        most = max(most, now.moved2_m2(blocks.x_m.data() + first, count, seen_then, seen_now));
      });
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
  /// Notes how far nodes may move, counted from where they are now if a point found new capacity.
  template <class Block>
  TACTUS_HD void fall_asleep(const Block& b, const Shared& s, const ContactFinder& finder, Index block,
                             float moved_m) const {
    const Index first = blocks.points[block].begin, count = blocks.points[block].end - first;
    bool has_capacity = false, any = false;
    for (int t = 0; t < count; ++t) {
      any = any || s.sleep_m[t] >= 0.F;
      has_capacity = has_capacity || s.sleep_m[t] > 0.F;
    }
    if (!any) return;
    b.for_own(count, [&](int t) {
      if (s.sleep_m[t] >= 0.F)
        blocks.sleep_m[first + t] = s.sleep_m[t];
      else if (has_capacity)
        blocks.sleep_m[first + t] -= moved_m;
    });
    if (!has_capacity) return;
    b.on_one_thread([&] { blocks.pose[block] = finder.pose; });
    const Index first_node = blocks.lists[block].begin;
    b.for_range(blocks.lists[block].end - first_node, [&](int k) {
      blocks.x_m[first_node + k] = finder.body.nodes.position(blocks.nodes[first_node + k]);
    });
  }
};

/// Shared memory of a block that works on one point.
class FoundPoint {
 public:
  PointQuery point;
  MeetingPoint meeting[kColliders];
  ListedTriangle list[kNearTriangles];
  std::uint32_t deciding[kListWords];
  LeastOfTriangles least[kColliders];
  ColliderApart apart[kColliders];
  template <class Block>
  TACTUS_HD void begin(const Block& b, const ContactFinder& finder, Index i) {
    const EmbeddedPoint& of = finder.body.table.points[i];
    b.for_threads(8, [&](int k) {
      node_m_[k] = finder.body.nodes.position(of.node[k]);
      node_m_s_[k] = finder.body.nodes.velocity(of.node[k]);
    });
    b.on_one_thread([&] {
      point.meeting = meeting;
      point.list = list;
      point.deciding = deciding;
      finder.resume(i, of.position([&](int k) { return node_m_[k]; }),
                    of.velocity([&](int k) { return node_m_s_[k]; }), point);
    });
  }
  /// How the point meets colliders, given as bits.
  template <class Block>
  TACTUS_HD void meet(const Block& b, const ContactFinder& finder, Index i, std::uint32_t colliders) {
    if constexpr (Block::kIsLoop) {
      for (; colliders != 0U; colliders &= colliders - 1U) meet(finder, i, lowest_bit(colliders));
    } else {
      b.for_threads(kColliders, [&](int collider) {
        if ((colliders >> collider & 1U) != 0U) meet(finder, i, collider);
      });
    }
  }
  /// One thread looks at the triangles that may decide, so a GPU's lanes leave it few. On a CPU, which has
  /// one lane, that would be for nothing.
  template <class Block>
  TACTUS_HD void see_list(const Block& b, const ContactFinder& finder, Index i) {
    const Index count = point.near.count;
    if constexpr (Block::kIsLoop) {
      b.for_range(count, [&](int e) { finder.see(i, e, point); });
      for (Index word = 0; word < kListWords; ++word) deciding[word] = 0;
      for (Index e = 0; e < count; ++e) deciding[e / kListBits] |= bit(e);
    } else {
      const float reach2_m2 = sqr(finder.body.reach_m);
      b.for_range(kColliders, [&](int collider) { least[collider] = {}; });
      b.for_range(count, [&](int e) {
        finder.see(i, e, point);
        least[list[e].near.collider].see(list[e].seen, reach2_m2);
      });
      b.for_range(kListWords, [&](int word) { deciding[word] = 0; });
      b.for_range(count, [&](int e) {
        if (least[list[e].near.collider].may_decide(list[e].seen, reach2_m2))
          atomic_or(deciding[e / kListBits], bit(e));
      });
    }
  }

 private:
  Vec3f node_m_[8], node_m_s_[8];
  TACTUS_HD void meet(const ContactFinder& finder, Index i, Index collider) {
    meeting[collider] = finder.meet(i, collider, point.x_m, point.v_m_s);
  }
  TACTUS_HD static std::uint32_t bit(Index e) { return 1U << static_cast<unsigned>(e % kListBits); }
};

/// Block: a point that is awake. Looks at its list; where that is of no use, or turns out to be too short,
/// searches round the point. A GPU has few such points, and waits for code and for single threads: lanes read
/// from memory together.
struct FindContacts {
  static constexpr int kThreads = TriangleSearch::kLanes, kGrain = 8;
  static constexpr bool kLoadsTogether = true;
  ContactFinder finder;
  Index takes_last = 0;  ///< 0: all points that are awake but the last (SubstepsTo); 1: these alone
  struct Shared {
    FoundPoint found;
    TriangleSearch search;
  };
  TACTUS_HD void load() {
    finder.load();
    if (takes_last != 0) finder.turn_to(finder.now.first_later);
  }

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index awake = finder.body.state.awake.points[b.index()], i = awake < 0 ? ~awake : awake;
    if ((i < finder.now.first_later) == (takes_last != 0)) return;
    FoundPoint& found = s.found;
    const PointQuery& p = found.point;
    found.begin(b, finder, i);
    // First by the list that is there, then by a new one. Where that is too short as well, a GPU's lanes look
    // for the gap together.
    constexpr int kRounds = Block::kIsLoop ? 2 : 3;
    TACTUS_ROLLED
    for (int round = awake < 0 ? 1 : 0; round < kRounds; ++round) {
      if (round > 0) {
        finder.lose(b, found.apart, found.point);
        found.meet(b, finder, i, p.to_search);
        finder.search(b, i, found.point, s.search, round == 1);
      } else {
        found.meet(b, finder, i, p.near.colliders);
      }
      if (p.now != PointQuery::Now::listed) break;
      found.see_list(b, finder, i);
      b.on_one_thread([&] { finder.conclude(i, round + 1 < kRounds, found.point); });
      const bool is_lost = p.now == PointQuery::Now::lost;
      b.barrier();  // it is lost again at once
      if (!is_lost) break;
    }
    b.on_one_thread([&] {
      if (p.now == PointQuery::Now::nothing) finder.invalidate(i);
    });
  }
};

}  // namespace tactus
