#pragma once
/// Sums over neighbours, the inner loop of particle methods.
#include "tactus/base/bits.h"
#include "tactus/compute/wide_load.h"
#include "tactus/geom/search/neighbour_cells.h"

namespace tactus {

/// Neighbours that a visit found, for the visits that follow while nothing moves. On a GPU there is one list
/// a particle; on a CPU, one for the eight that are visited together. Where a list has no capacity cells are
/// searched again, so sums don't depend on the capacity.
///
/// Visits whose pairs have a weight (VisitNeighbours) share it: on a CPU, the one that writes the lists keeps
/// those of the first entries, for it takes most of a visit's time; on a GPU, memory would.
struct NearLists {
  static constexpr Index kCapacity = 64;  ///< a particle
  static constexpr Index kFull = -1;
  static constexpr Index kFour = 4;               ///< entries that a GPU's thread reads and writes at once
  static constexpr Index kRow = 32;               ///< particles whose lists are interwoven on a GPU
  static constexpr Index kWeights = 16;           ///< a particle; for eight, of so many times eight entries
  static constexpr Index kMostWeighed = 1 << 16;  ///< particles: 34 MB
  View<Index> count;                              ///< by slot; on a CPU, of eight at the first's
  View<Index> near;
  View<float> weight = {};  ///< of the first particles, as far as it goes; may be empty
  struct alignas(16) Four {
    Index slot[kFour];
  };
  TACTUS_HD static Index size(Index particles) { return ceil_div(particles, kRow) * kRow * kCapacity; }
  /// Entries 4 q to 4 q + 3 of a particle's list.
  TACTUS_HD Four& four(Index i, Index q) const {
    return reinterpret_cast<Four*>(near.data())[(i / kRow * (kCapacity / kFour) + q) * kRow + i % kRow];
  }
  TACTUS_HD View<Index> of_eight(Index first) const {
    return near.part(first * kCapacity, kVisitLanes * kCapacity);
  }
  static Index weights(Index particles) {
    return ceil_div(min(particles, kMostWeighed), kVisitLanes) * kVisitLanes * kVisitLanes * kWeights;
  }
  /// Entries of eight particles' list whose weights are kept.
  TACTUS_HD Index weights_of_eight(Index first) const {
    return (first + kVisitLanes) * (kVisitLanes * kWeights) <= weight.size() ? kVisitLanes * kWeights : 0;
  }
  TACTUS_HD float* weight_of_eight(Index first, Index entry) const {
    return weight.data() + (first * kWeights + entry) * kVisitLanes;
  }
};
enum class ListUse : Index { none, write, read };

/// The numbers of the bits that are set, for all sets of eight.
struct SetBits {
  std::uint8_t of[256][8] = {};
  constexpr SetBits() {
    for (int set = 0; set < 256; ++set) {
      for (int bit = 0, n = 0; bit < 8; ++bit)
        if (set >> bit & 1) of[set][n++] = static_cast<std::uint8_t>(bit);
    }
  }
};
inline constexpr SetBits kSetBits;

/// Visits, for every particle of `of`, all particles of `among` within reach: a block kernel, launched with
/// NeighbourSearch::groups(). `Pair` defines the sums:
///
///   struct Density {                                        // rho_i = sum_j m W(x_ij)
///     template <int kLanes> struct Own { float rho[kLanes]; };          // one place for each of several i
///     template <int kLanes> void begin(Own<kLanes>& own, int t, Index i) const;  // particle i is lane t
///     template <int kLanes>
///     void add(Own<kLanes>& own, int t, Index j, Vec3f d_m, float r2_m2, bool near) const;
///     template <int kLanes> void end(const Own<kLanes>& own, int t, Index i) const;
///   };
///
/// With `static constexpr bool kNearOnly = true`, add is called for neighbours in reach alone: for work that
/// a loop over lanes can't do. With `static constexpr int kAtOnce = 4`, a GPU's thread loads four listed
/// neighbours at once instead of eight: for work that needs the registers itself.
///
/// With `float weight(float r2_m2, bool near) const`, add gets it as one more argument. It must be the same
/// in all visits of the same lists that have one, and the visit that writes them must be among those.
///
/// i and j are slots of the two searches, d = x_j - x_i; a particle is its own neighbour. `add` may be called
/// for a j out of reach (at a finite distance), and must add exactly nothing then (select a zero: on a CPU,
/// it runs for eight i at once). The order of the sums is that of NeighbourCells: the same bits on every
/// device. A Pair may have load(), as kernels have.
template <class Pair, ListUse kUse = ListUse::none>
struct VisitNeighbours {
  static constexpr int kThreads = kVisitLanes;
  static constexpr int kGrain = 64;
  using Shared = NoShared;
  static constexpr Index kWidest = 2;  ///< cells from the first to the last particle of one run, at most

  NeighbourCells of, among;
  float reach_m2;
  Pair pair;
  NearLists lists = {};
  /// (1), or empty: particles of `of` that were given from that number on are copies, and are left out.
  View<const Index> first_copy = {};

  TACTUS_HD void load() requires LoadingKernel<Pair> { pair.load(); }
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index first = b.index() * kThreads, lanes = min(of.placed[0] - first, Index(kThreads));
    if constexpr (Block::kIsLoop) {
      visit_together(first, lanes);
    } else {
      b.for_each_thread([&](int t) {
        if (t < lanes) visit_alone(first + t);
      });
    }
  }

 private:
  static constexpr bool kWeighs = requires(const Pair& p) { p.weight(1.F, true); };
  using Own1 = typename Pair::template Own<1>;
  using Own8 = typename Pair::template Own<kThreads>;
  struct Lanes {
    float x[kThreads], y[kThreads], z[kThreads];
  };
  struct Runs {
    SlotRun run[(kWidest + 3) * 9];
    int count = 0;
  };
  /// Lanes side by side in a row of cells share their candidates.
  struct Row {
    int begin, end;  ///< lanes
    Runs runs;
    TACTUS_HD Row(int first) : begin(first), end(first + 1) {}
  };

  TACTUS_HD bool is_copy(Index i) const { return !first_copy.empty() && of.order[i] >= first_copy[0]; }

  TACTUS_HD void visit_alone(Index i) const {
    if (is_copy(i)) return;
    const Vec3f x = of.particles[i].x_m;
    Own1 own;
    pair.begin(own, 0, i);
    Index listed = NearLists::kFull;
    if constexpr (kUse == ListUse::read) listed = lists.count[i];
    if constexpr (kUse == ListUse::write) {
      listed = list_alone(x, i);
      lists.count[i] = listed;
    }
    const auto add = [&](Index j) {
      const Vec3f d = load_constant(among.particles, j).x_m - x;
      if (const float r2 = dot(d, d); r2 <= reach_m2) add_one(own, 0, j, d, r2, true);
    };
    if constexpr (kUse == ListUse::none) {
      for_each_near(x, add);
    } else {
      if (listed != NearLists::kFull)
        add_listed_alone(own, x, i, listed);
      else
        for_each_candidate(x, add);
    }
    pair.end(own, 0, i);
  }
  /// So many loads are under way at once. One after the other, a thread would wait for memory each time.
  static constexpr int kListedAtOnce = 8;
  static constexpr int at_once() {
    if constexpr (requires { Pair::kAtOnce; })
      return Pair::kAtOnce;
    else
      return kListedAtOnce;
  }
  /// f(j) for all particles in the cells around a point, in the order of a visit. Lists have capacity for
  /// nearly all, so code for the others is short rather than fast.
  template <class F>
  TACTUS_HD TACTUS_ALWAYS_INLINE void for_each_candidate(Vec3f x, F&& f) const {
    among.for_each_run_around(x, [&](SlotRun run) {
      TACTUS_ROLLED
      for (Index slot = run.first; slot < run.last; ++slot) f(slot);
    });
  }
  /// f(j) for those in reach.
  template <class F>
  TACTUS_HD TACTUS_ALWAYS_INLINE void for_each_near(Vec3f x, F&& f) const {
    among.for_each_run_around(x, [&](SlotRun run) {
      TACTUS_ROLLED
      for (Index first = run.first; first < run.last; first += kListedAtOnce) {
        SearchParticle other[kListedAtOnce];
        for (int u = 0; u < kListedAtOnce; ++u)
          other[u] = load_constant(among.particles, min(first + u, run.last - 1));
        std::uint32_t near = 0;
        for (int u = 0; u < kListedAtOnce; ++u) {
          const Vec3f d = other[u].x_m - x;
          near |= first + u < run.last && dot(d, d) <= reach_m2 ? 1U << u : 0U;
        }
        TACTUS_ROLLED
        for (; near != 0; near &= near - 1) f(first + lowest_bit(near));
      }
    });
  }
  TACTUS_HD Index list_alone(Vec3f x, Index i) const {
    Index listed = 0;
    NearLists::Four last{};  // the last four entries
    const auto list = [&](Index slot) {
      for (int u = 0; u + 1 < NearLists::kFour; ++u) last.slot[u] = last.slot[u + 1];
      last.slot[NearLists::kFour - 1] = slot;
      ++listed;
      if (listed % NearLists::kFour == 0 && listed <= NearLists::kCapacity)
        store_wide(lists.four(i, listed / NearLists::kFour - 1), last);
    };
    for_each_near(x, list);
    const Index found = listed;
    while (listed % NearLists::kFour != 0) list(i);  // so that four can be read
    return found <= NearLists::kCapacity ? found : NearLists::kFull;
  }
  TACTUS_HD void add_listed_alone(Own1& own, Vec3f x, Index i, Index listed) const {
    constexpr int kAtOnce = at_once();
    Index k = 0;
    TACTUS_ROLLED
    for (; k + kAtOnce <= listed; k += kAtOnce) add_some<kAtOnce>(own, x, i, k, k + kAtOnce);
    TACTUS_ROLLED
    for (; k < listed; k += NearLists::kFour) add_some<NearLists::kFour>(own, x, i, k, listed);
  }
  /// Of entries k to k + kCount - 1, those before `end`.
  template <int kCount>
  TACTUS_HD TACTUS_ALWAYS_INLINE void add_some(Own1& own, Vec3f x, Index i, Index k, Index end) const {
    static_assert(kCount % NearLists::kFour == 0);
    Index j[kCount];
    SearchParticle other[kCount];
    for (int q = 0; q < kCount / NearLists::kFour; ++q) {
      const NearLists::Four four = load_wide(lists.four(i, k / NearLists::kFour + q));
      for (int u = 0; u < NearLists::kFour; ++u) j[q * NearLists::kFour + u] = four.slot[u];
    }
    for (int u = 0; u < kCount; ++u) other[u] = load_constant(among.particles, j[u]);
    for (int u = 0; u < kCount; ++u) {
      if (k + u >= end) return;
      const Vec3f d = other[u].x_m - x;
      add_one(own, 0, j[u], d, dot(d, d), true);
    }
  }

  /// A particle out of one lane's reach adds nothing there.
  TACTUS_HD void visit_together(Index first, int lanes) const {
    Own8 own;
    Lanes at;
    Vec3i cell[kThreads];
    for (int t = 0; t < kThreads; ++t) {
      const Index i = first + min(t, lanes - 1);
      const Vec3f x = of.particles[i].x_m;
      at.x[t] = x.x, at.y[t] = x.y, at.z[t] = x.z;
      cell[t] = among.hash.holds(x) ? among.hash.cell(x) : Vec3i{1 << 30, 1 << 30, 1 << 30};
      pair.begin(own, t, i);
    }
    if (kUse == ListUse::read && lists.count[first] != NearLists::kFull) {
      const View<const Index> list = lists.of_eight(first);
      for (Index k = 0; k < lists.count[first];) {
        const int begin = list[k], end = list[k + 1];
        const Index last = list[k + 2];
        add_listed(own, begin == 0 && end == lanes ? at : only(at, begin, end), first, k + kHead, last);
        k = last;
      }
    } else {
      Index listed = 0;
      for (int a = 0; a < lanes;) {
        const Row row = row_from(cell, a, lanes);
        const Lanes in_row = a == 0 && row.end == lanes ? at : only(at, a, row.end);
        const Index before = listed;
        if constexpr (kUse == ListUse::write) write_row(row, at, lists.of_eight(first), listed);
        if (kUse == ListUse::write && listed != NearLists::kFull)
          listed = add_and_keep(own, in_row, first, before, listed);
        else
          add_runs(own, in_row, row.runs);
        a = row.end;
      }
      if (kUse == ListUse::write) lists.count[first] = listed;
    }
    for (int t = 0; t < lanes; ++t)
      if (!is_copy(first + t)) pair.end(own, t, first + t);
  }

  TACTUS_HD Row row_from(const Vec3i* cell, int a, int lanes) const {
    Row row(a);
    Index low = cell[a].x, high = low;
    for (; row.end < lanes && cell[row.end].y == cell[a].y && cell[row.end].z == cell[a].z; ++row.end) {
      const Index x = cell[row.end].x, new_low = min(low, x), new_high = max(high, x);
      if (new_high - new_low > kWidest) break;
      low = new_low, high = new_high;
    }
    if (low == 1 << 30) return row;
    among.for_each_run({low - 1, cell[a].y - 1, cell[a].z - 1}, {high + 1, cell[a].y + 1, cell[a].z + 1},
                       [&](SlotRun run) {
                         row.runs.run[row.runs.count] = run;
                         row.runs.count += run.first < run.last ? 1 : 0;
                       });
    return row;
  }
  /// A list of lanes that are visited together has for each row {first lane, last lane, end} before the slots
  /// of the particles near the box of these lanes.
  static constexpr Index kHead = 3;
  TACTUS_HD void write_row(const Row& row, const Lanes& at, View<Index> list, Index& listed) const {
    if (listed == NearLists::kFull) return;
    Vec3f low{at.x[row.begin], at.y[row.begin], at.z[row.begin]}, high = low;
    for (int t = row.begin + 1; t < row.end; ++t) {
      const Vec3f x{at.x[t], at.y[t], at.z[t]};
      low = min(low, x), high = max(high, x);
    }
    const Index most = list.size() - kVisitLanes;
    Index n = listed + kHead;
    for (int r = 0; r < row.runs.count; ++r) {
      const SlotRun run = row.runs.run[r];
      for (Index first = run.first; first < run.last; first += kVisitLanes) {
        // There is capacity behind the last.
        const SearchParticle* eight = among.particles.data() + first;
        const std::uint32_t last = min(run.last - 1 - first, kVisitLanes - 1),
                            near = (near_box(eight, low, high) | near_box(eight + 4, low, high) << 4) &
                                   ((2U << last) - 1);
        n = min(n, most);
#pragma omp simd
        for (int t = 0; t < kVisitLanes; ++t) list[n + t] = first + kSetBits.of[near][t];
        n += popcount(near);
      }
    }
    if (n >= most) {
      listed = NearLists::kFull;
      return;
    }
    list[listed] = row.begin;
    list[listed + 1] = row.end;
    list[listed + 2] = n;
    listed = n;
  }

  /// Bits of those of four particles that are within reach of a box. (They are copied first, for the compiler
  /// makes no vectors of distances to structs; of eight, it would have to wait for the copies.)
  TACTUS_HD std::uint32_t near_box(const SearchParticle* four, Vec3f low, Vec3f high) const {
    float at_x[4], at_y[4], at_z[4];
#pragma omp simd
    for (int t = 0; t < 4; ++t) at_x[t] = four[t].x_m.x, at_y[t] = four[t].x_m.y, at_z[t] = four[t].x_m.z;
    std::uint32_t near = 0;
#pragma omp simd reduction(| : near)
    for (int t = 0; t < 4; ++t) {
      const float x = max(low.x - at_x[t], at_x[t] - high.x), y = max(low.y - at_y[t], at_y[t] - high.y),
                  z = max(low.z - at_z[t], at_z[t] - high.z);
      const float r2 = sqr(x > 0.F ? x : 0.F) + sqr(y > 0.F ? y : 0.F) + sqr(z > 0.F ? z : 0.F);
      near |= r2 <= 1.0001F * reach_m2 ? 1U << t : 0U;  // rounding
    }
    return near;
  }

  /// Lanes outside of [begin, end) are far from everything, but finite: 0 times their distance is 0.
  TACTUS_HD static Lanes only(const Lanes& at, int begin, int end) {
    Lanes some = at;
    for (int t = 0; t < kThreads; ++t)
      if (t < begin || t >= end) some.x[t] = 1e18F;
    return some;
  }

  TACTUS_HD void add_runs(Own8& own, const Lanes& at, const Runs& runs) const {
    for (int r = 0; r < runs.count; ++r) {
      for (Index j = runs.run[r].first; j < runs.run[r].last; ++j) add(own, at, j);
    }
  }
  /// Entries [k, last) of the list of the eight from `first` on.
  TACTUS_HD void add_listed(Own8& own, const Lanes& at, Index first, Index k, Index last) const {
    const View<const Index> list = lists.of_eight(first);
    if constexpr (kWeighs) {
      for (const Index kept = min(last, lists.weights_of_eight(first)); k < kept; ++k)
        add_weighed(own, at, list[k], lists.weight_of_eight(first, k));
    }
    for (; k < last; ++k) add(own, at, list[k]);
  }
  /// The entries of a row that write_row has written, of which those stay that are near a lane: two of three.
  /// @returns the end of the row
  TACTUS_HD Index add_and_keep(Own8& own, const Lanes& at, Index first, Index head, Index last) const {
    const View<Index> list = lists.of_eight(first);
    const Index weights = kWeighs ? lists.weights_of_eight(first) : 0;
    Index end = head + kHead;
    for (Index k = head + kHead; k < last; ++k) {
      float unkept[kThreads];
      float* weight = end < weights ? lists.weight_of_eight(first, end) : unkept;
      list[end] = list[k];
      end += add_weighed(own, at, list[k], weight) ? 1 : 0;
    }
    list[head + kHead - 1] = end;
    return end;
  }
  TACTUS_HD TACTUS_ALWAYS_INLINE void add(Own8& own, const Lanes& at, Index j) const {
    if constexpr (near_only())
      add_near(own, at, j);
    else
      add_all(own, at, j);
  }
  TACTUS_HD void add_all(Own8& own, const Lanes& at, Index j) const {
    const Vec3f x = among.particles[j].x_m;
#pragma omp simd
    for (int t = 0; t < kThreads; ++t) {
      const float dx = x.x - at.x[t], dy = x.y - at.y[t], dz = x.z - at.z[t];
      const float r2 = dx * dx + dy * dy + dz * dz;
      add_one(own, t, j, {dx, dy, dz}, r2, r2 <= reach_m2);
    }
  }
  /// As add_all, with the weights of eight pairs that are kept, or are to be. @returns whether one is near
  TACTUS_HD bool add_weighed(Own8& own, const Lanes& at, Index j, float* weight) const {
    const Vec3f x = among.particles[j].x_m;
    std::uint32_t is_near = 0;
#pragma omp simd reduction(| : is_near)
    for (int t = 0; t < kThreads; ++t) {
      const float dx = x.x - at.x[t], dy = x.y - at.y[t], dz = x.z - at.z[t];
      const float r2 = dx * dx + dy * dy + dz * dz;
      const bool near = r2 <= reach_m2;
      if constexpr (kWeighs) {
        if constexpr (kUse == ListUse::write) weight[t] = pair.weight(r2, near);
        pair.add(own, t, j, {dx, dy, dz}, r2, near, weight[t]);
      } else {
        pair.add(own, t, j, {dx, dy, dz}, r2, near);
      }
      is_near |= near ? 1U : 0U;
    }
    return is_near != 0;
  }
  TACTUS_HD void add_near(Own8& own, const Lanes& at, Index j) const {
    const Vec3f x = among.particles[j].x_m;
    std::uint32_t near = 0;
#pragma omp simd reduction(| : near)
    for (int t = 0; t < kThreads; ++t) {
      const float dx = x.x - at.x[t], dy = x.y - at.y[t], dz = x.z - at.z[t];
      near |= dx * dx + dy * dy + dz * dz <= reach_m2 ? 1U << t : 0U;
    }
    for (; near != 0; near &= near - 1) {
      const int t = lowest_bit(near);
      const Vec3f d{x.x - at.x[t], x.y - at.y[t], x.z - at.z[t]};
      add_one(own, t, j, d, dot(d, d), true);
    }
  }
  template <class Own>
  TACTUS_HD TACTUS_ALWAYS_INLINE void add_one(Own& own, int t, Index j, Vec3f d, float r2, bool near) const {
    if constexpr (kWeighs)
      pair.add(own, t, j, d, r2, near, pair.weight(r2, near));
    else
      pair.add(own, t, j, d, r2, near);
  }
  static constexpr bool near_only() {
    if constexpr (requires { Pair::kNearOnly; })
      return Pair::kNearOnly;
    else
      return false;
  }
};

}  // namespace tactus
