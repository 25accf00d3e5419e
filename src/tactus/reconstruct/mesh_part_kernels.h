#pragma once
/// How the parts of a device set make one mesh: numbers within each, its place among all, copies to there.
#include "tactus/reconstruct/mesh_kernels.h"

namespace tactus {

/// Replaces the counts of the bricks by their sums over all bricks before, and collects the part's. One
/// block: there are too few bricks to share.
struct NumberBricks {
  View<const PartRange> range;
  View<std::uint64_t> mesh_start;  ///< in: MeshCounts, per slot; out: scanned, with the sum of all behind
  View<PartCounts> counts;         ///< out

  static constexpr int kThreads = 512, kEach = 8, kPiece = kThreads * kEach;
  struct Shared {
    std::uint64_t value[kPiece + kThreads];  ///< a gap behind each thread's: threads meet in no memory bank
    std::uint64_t sum[2][kThreads];
    std::uint64_t before;
    TACTUS_HD std::uint64_t& at(int i) { return value[i + i / kEach]; }
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index n = min(range[0].counted, mesh_start.size() - 1);
    b.on_one_thread([&] { s.before = 0; });
    for (Index first = 0; first < n; first += kPiece) {
      const int count = min(n - first, Index{kPiece});
      b.for_range(kPiece, [&](int i) { s.at(i) = i < count ? mesh_start[first + i] : 0U; });
      scan_piece(b, s);
      b.for_range(count, [&](int i) { mesh_start[first + i] = s.at(i); });
    }
    b.on_one_thread([&] {
      mesh_start[n] = s.before;
      // Beyond the capacity there are no counts to trust: the numbers of bricks show the host how many slots
      // were missing.
      const MeshCount own{mesh_start[min(range[0].own, mesh_start.size() - 1)]};
      counts[0] = {own.vertices(), own.triangles(), range[0].own, range[0].held};
    });
  }

 private:
  template <class Block>
  TACTUS_HD void scan_piece(const Block& b, Shared& s) const {
    b.for_each_thread([&](int t) {
      std::uint64_t sum = 0;
      for (int i = 0; i < kEach; ++i) sum += s.at(t * kEach + i);
      s.sum[0][t] = sum;
    });
    int from = 0;
    for (int reach = 1; reach < kThreads; reach *= 2, from = 1 - from) {
      b.for_each_thread(
          [&](int t) { s.sum[1 - from][t] = s.sum[from][t] + (t >= reach ? s.sum[from][t - reach] : 0U); });
    }
    b.for_each_thread([&](int t) {
      std::uint64_t running = s.before + (t > 0 ? s.sum[from][t - 1] : 0U);
      for (int i = 0; i < kEach; ++i) {
        const std::uint64_t value = s.at(t * kEach + i);
        s.at(t * kEach + i) = running;
        running += value;
      }
    });
    b.on_one_thread([&] { s.before += s.sum[from][kThreads - 1]; });
  }
};

/// Finds a part's place, and how large all parts are together.
struct PlacePart {
  View<const PartCounts> counts[kMaxHullParts];  ///< of each part, one; in its own memory or a copy
  Index part, parts;
  View<PartPlace> place;   ///< out
  View<PartCounts> total;  ///< out
  TACTUS_HD void operator()(Index) const {
    PartCounts sum;
    PartPlace at;
    for (Index p = 0; p < parts; ++p) {
      const PartCounts one = counts[p][0];
      if (p == part) at = {sum.vertices, sum.triangles, 3 * one.vertices, 3 * one.triangles};
      sum.vertices += one.vertices;
      sum.triangles += one.triangles;
      sum.active_bricks += one.active_bricks;
      sum.held_bricks += one.held_bricks;
    }
    place[0] = at;
    total[0] = sum;
  }
};

/// Copies a part's vertices or triangles to their place, word by word: full lines cross the link.
struct PushWords {
  View<const std::uint32_t> from;
  View<const Index> first;  ///< element of the place where they go; elements are three words
  View<std::uint32_t> to;
  TACTUS_HD void operator()(Index i) const {
    const std::int64_t at = 3 * std::int64_t{first[0]} + i;
    if (at < to.size()) to[static_cast<Index>(at)] = from[i];
  }
};

}  // namespace tactus
