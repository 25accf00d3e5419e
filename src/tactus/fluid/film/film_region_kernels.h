#pragma once
/// Lists of all that a frame of a film looks at, so that its cost follows the wet part: wet vertices, some
/// rings more, and their triangles.
///
/// A frame begins with the vertices that the last one looked at, and those that liquid was given to since:
/// only they can be wet. Lists are in no certain order. All that is done for an entry depends on no other
/// entry's place, so results don't depend on it either.
#include "tactus/compute/atomic.h"
#include "tactus/fluid/film/film_surface.h"

namespace tactus {

/// Numbers on the device, in one array.
struct FilmCounts {
  static constexpr Index kNear = 0,  ///< vertices of the next frame's list
      kVertices = 1, kTriangles = 2,
                         kFirstRing = 3;  ///< vertices of each ring: wet ones, those next to them, ...
  static constexpr Index size(Index rings) { return kFirstRing + rings + 1; }
  View<Index> all;
  TACTUS_HD std::uint32_t& counter(Index which) const { return reinterpret_cast<std::uint32_t&>(all[which]); }
  TACTUS_HD Index add(Index which, Index n = 1) const {
    return static_cast<Index>(atomic_fetch_add(counter(which), static_cast<std::uint32_t>(n)));
  }
};

/// A film that is given liquid between two of its frames.
struct FilmGains {
  View<std::int64_t> volume;
  View<Index> mark;  ///< 0: the next frame would not look at the vertex
  View<Index> near;
  FilmCounts counts;
  /// Several threads may, at once.
  TACTUS_HD void give(Index v, std::int64_t units) const {
    atomic_add(reinterpret_cast<std::uint64_t&>(volume[v]), static_cast<std::uint64_t>(units));
    note(v);
  }
  TACTUS_HD void note(Index v) const {
    constexpr std::uint32_t kNoted = 1U << 16U;  // in no ring
    auto& own = reinterpret_cast<std::uint32_t&>(mark[v]);
    if (atomic_load(own) == 0 && atomic_replace(own, 0U, kNoted) == 0)
      near[counts.add(FilmCounts::kNear)] = v;
  }
};

/// Thread: vertex. Notes the wet ones: where others than the exchange changed volumes.
struct NoteWetFilm {
  FilmGains gains;  ///< its list is empty
  View<Index> change;
  View<float> height_m;
  TACTUS_HD void operator()(Index v) const {
    gains.mark[v] = 0;
    if (gains.volume[v] > 0) {
      gains.note(v);
      return;
    }
    height_m[v] = 0;
    change[v] = 0;
  }
};

/// Block: kThreads vertices of the list. The wet ones are ring 0. Others may have taken all of a vertex'
/// volume: its height is 0 then.
struct KeepWetFilm {
  static constexpr int kThreads = 256;
  static constexpr int kGrain = 8;
  FilmGains gains;
  View<Index> change;
  View<float> height_m;
  View<Index> region;
  struct Shared {
    std::uint32_t count;
    Index first;
    Index vertex[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index begin = b.index() * kThreads, n = gains.counts.all[FilmCounts::kNear];
    if (begin >= n) return;
    b.on_one_thread([&] { s.count = 0; });
    b.for_each_thread([&](int t) {
      if (begin + t >= n) return;
      const Index v = gains.near[begin + t];
      const bool is_wet = gains.volume[v] > 0;
      gains.mark[v] = is_wet ? 1 : 0;
      if (is_wet) {
        s.vertex[atomic_fetch_add(s.count, 1U)] = v;
        return;
      }
      height_m[v] = 0;
      change[v] = 0;
    });
    b.on_one_thread([&] {
      s.first = s.count > 0 ? gains.counts.add(FilmCounts::kFirstRing, static_cast<Index>(s.count)) : 0;
    });
    b.for_threads(static_cast<int>(s.count), [&](int t) { region[s.first + t] = s.vertex[t]; });
  }
};

/// Thread: vertex of a ring. Its neighbours that are in none yet are the next ring.
struct MarkFilmRing {
  static constexpr int kAtOnce = 4;  ///< triangles: a GPU's thread waits for their corners together
  FilmSurface surface;
  View<Index> mark;
  FilmCounts counts;
  View<Index> region;
  Index ring = 0;  ///< of the thread's vertex
  Index first = 0;
  TACTUS_HD void load() {
    first = 0;
    for (Index k = 0; k < ring; ++k) first += counts.all[FilmCounts::kFirstRing + k];
  }
  TACTUS_HD void operator()(Index i) const {
    const Index v = region[first + i], next = first + counts.all[FilmCounts::kFirstRing + ring];
    const IndexRange list = surface.lists[v];
    for (Index e = list.begin; e < list.end; e += kAtOnce) {
      Index corner[3 * kAtOnce];
      bool is_free[3 * kAtOnce];
      for (int c = 0; c < 3 * kAtOnce; ++c)
        corner[c] = surface.corners[3 * surface.incident[min(e + c / 3, list.end - 1)] + c % 3];
      for (int c = 0; c < 3 * kAtOnce; ++c) is_free[c] = atomic_load(own_mark(corner[c])) == 0;
      for (int c = 0; c < 3 * kAtOnce; ++c)
        if (is_free[c] && atomic_replace(own_mark(corner[c]), 0U, static_cast<std::uint32_t>(ring) + 2) == 0)
          region[next + counts.add(FilmCounts::kFirstRing + ring + 1)] = corner[c];
    }
  }

 private:
  TACTUS_HD std::uint32_t& own_mark(Index v) const { return reinterpret_cast<std::uint32_t&>(mark[v]); }
};

/// Adds the rings up, and empties all for the lists that follow.
struct CountFilmRegion {
  FilmCounts counts;
  TACTUS_HD void operator()(Index) const {
    Index vertices = 0;
    for (Index k = FilmCounts::kFirstRing; k < counts.all.size(); ++k) {
      vertices += counts.all[k];
      counts.all[k] = 0;
    }
    counts.all[FilmCounts::kVertices] = counts.all[FilmCounts::kNear] = vertices;
    counts.all[FilmCounts::kTriangles] = 0;
  }
};

/// Block: kThreads vertices of the region. They begin the next frame's list; and the triangles round them,
/// each listed by the first of its corners that is in the region.
struct ListFilmTriangles {
  static constexpr int kThreads = 256;
  static constexpr int kGrain = 8;
  FilmSurface surface;
  View<const Index> mark;
  FilmCounts counts;
  View<const Index> region;
  View<Index> near, triangle;
  struct Shared {
    std::uint32_t count;
    Index first;
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index begin = b.index() * kThreads, n = counts.all[FilmCounts::kVertices];
    if (begin >= n) return;
    b.on_one_thread([&] { s.count = 0; });
    typename Block::template PerThread<Index> place;
    typename Block::template PerThread<std::uint32_t> own;
    b.for_each_thread([&](int t) {
      if (begin + t >= n) return;
      const Index v = region[begin + t];
      near[begin + t] = v;
      std::uint32_t count = 0, bits = 0;
      const IndexRange list = surface.lists[v];
      for (Index e = list.begin; e < list.end; ++e) {
        if (!is_own(surface.incident[e], v)) continue;
        ++count;
        if (e - list.begin < kBits) bits |= 1U << static_cast<unsigned>(e - list.begin);
      }
      own[t] = bits;
      place[t] = count > 0 ? static_cast<Index>(atomic_fetch_add(s.count, count)) : 0;
    });
    b.on_one_thread([&] { s.first = counts.add(FilmCounts::kTriangles, static_cast<Index>(s.count)); });
    b.for_each_thread([&](int t) {
      if (begin + t >= n) return;
      const Index v = region[begin + t];
      const IndexRange list = surface.lists[v];
      Index to = s.first + place[t];
      for (Index e = list.begin; e < list.end; ++e) {
        const Index i = surface.incident[e], bit = e - list.begin;
        if (bit < kBits ? (own[t] >> static_cast<unsigned>(bit) & 1U) != 0 : is_own(i, v)) triangle[to++] = i;
      }
    });
  }

 private:
  static constexpr Index kBits = 32;
  TACTUS_HD bool is_own(Index i, Index v) const {
    for (int k = 0; k < 2; ++k) {
      const Index other = surface.corners[3 * i + k];
      if (other == v) return true;
      if (mark[other] != 0) return false;
    }
    return true;
  }
};

/// All that a film has of its vertices, for those that move it to others.
struct FilmStore {
  FilmGains gains;
  View<std::int64_t> stain;
  View<Index> change;
  View<float> height_m;
};

}  // namespace tactus
