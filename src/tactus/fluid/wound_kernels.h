#pragma once
/// Wounds as emitters. A stroke owes volume: rate times area, fading with time. Whole particles of it come
/// out where there is room for them, and the rest waits: due = emitted + waiting, as integers.
///
/// Where a piece of a wound may bleed is tried out, half a spacing in front of it: walls and liquid must
/// leave room for a particle there. So a cut that is shut keeps its waiting volume, and one that gapes by a
/// diameter releases it. A piece at the skin that is shut tries outside of the skin, and one under liquid
/// tries above it.
#include "tactus/compute/atomic.h"
#include "tactus/compute/fold.h"
#include "tactus/fluid/flow_kernels.h"
#include "tactus/fluid/wound_piece.h"
#include "tactus/geom/search/neighbour_cells.h"

namespace tactus {

/// How a piece goes on.
struct WoundState {
  float lost = 0;     ///< share of the bleeding that is over, 0..1
  float deficit = 0;  ///< own due minus own emitted volume, in particles
  Index level = 0;    ///< where it tries: 0 in front of it, k > 0 k spacings above, -1 - k k above the rim
};

/// The volume ledger of a stroke.
struct WoundLedger {
  static constexpr double kUnits = 4294967296.0;  ///< of `due` in a particle's volume
  std::uint64_t due = 0;
  std::uint64_t emitted = 0;  ///< particles
  TACTUS_HD std::uint64_t waiting() const { return (due >> 32U) - emitted; }
};

/// Bits that look random.
TACTUS_HD inline std::uint32_t scattered(std::uint32_t i) {
  i = (i ^ i >> 16U) * 0x7FEB352DU;
  i = (i ^ i >> 15U) * 0x846CA68BU;
  return i ^ i >> 16U;
}

/// In spacings: nearer to a wall, there is no room. Half a spacing, less a margin for walls that bend.
inline constexpr float kWoundToWall = 0.45F;

/// The heart of a body.
struct WoundClock {
  double time_s = 0;       ///< since the run began, without what settled
  std::uint32_t turn = 0;  ///< parts of frames since then
  std::uint32_t unused = 0;
};

/// The rate swings as 1 + share sin(2 pi beats t).
struct Pulse {
  double beats_1_s = 0;  ///< 0: it flows evenly
  float share = 0;       ///< 0..1
  /// Of the rate over a time, as a factor. The integral's closed form, so whatever the frames' length, a beat
  /// brings what it brings without a pulse.
  TACTUS_HD float mean(double from_s, float dt_s) const {
    if (!(beats_1_s > 0)) return 1;
    const double turns = beats_1_s * static_cast<double>(dt_s), middle = beats_1_s * from_s + 0.5 * turns;
    const auto half = static_cast<float>(0.5 * turns);
    constexpr float kTwoPi = 6.28318531F;
    const float damped = half > 1e-4F ? sin_of_turns(half) / (kTwoPi * half) : 1.F;
    return 1.F + share * damped *
                     sin_of_turns(
                         static_cast<float>(middle - static_cast<double>(static_cast<std::int64_t>(middle))));
  }

 private:
  /// sin(2 pi x) for x >= 0, to 4e-6: its series to the ninth power within a quarter of a turn.
  TACTUS_HD static float sin_of_turns(float x) {
    float in_turn = x - static_cast<float>(static_cast<Index>(x));
    if (in_turn > 0.75F)
      in_turn -= 1.F;
    else if (in_turn > 0.25F)
      in_turn = 0.5F - in_turn;
    const float a = 6.28318531F * in_turn, a2 = a * a;
    return a * (1.F - a2 / 6.F * (1.F - a2 / 20.F * (1.F - a2 / 42.F * (1.F - a2 / 72.F))));
  }
};

/// Thread: piece. Adds the volume due for the coming part of a frame, and tries a place: in one part of four,
/// or in each where a piece owes more than a quarter of a particle a part.
struct TryWounds {
  static constexpr std::uint32_t kTurns = 4;
  View<const WoundPiece> pieces;
  View<const FrameParams> frame;
  View<const Vec3f> x_m, v_m_s;  ///< of nodes
  View<const WoundClock> clock;
  Pulse pulse;
  float rate_m_s, fading_1_s;  ///< 0: it doesn't fade
  float particle_1_m3, spacing_m;
  View<WoundState> states;
  View<WoundLedger> ledgers;
  View<Vec3f> place_m, speed_m_s;
  View<std::uint32_t> priority_key;  ///< emptied
  View<Index> is_shut;               ///< by its other side
  TACTUS_HD void operator()(Index i) const {
    const WoundPiece& p = pieces[i];
    WoundState s = states[i];
    const bool settles = frame[0].settles != 0;
    const float dt_s = settles ? 0.F : frame[0].dt_s * static_cast<float>(frame[0].substeps);
    const float left = 1.F - s.lost, mean = mean_of_fading(dt_s * fading_1_s);
    const float rate = rate_m_s * p.factor * pulse.mean(clock[0].time_s, dt_s);
    const float due = rate * p.area_m2 * particle_1_m3 * dt_s * left * mean;
    s.lost += left * (dt_s * fading_1_s * mean);
    s.deficit += due;
    states[i] = s;
    priority_key[i] = 0;
    atomic_add(ledgers[p.stroke].due,
               static_cast<std::uint64_t>(clamp(due, 0.F, 1e6F) * static_cast<float>(WoundLedger::kUnits)));
    const float nowhere = std::bit_cast<float>(0x7FC00000U);
    place_m[i] = {nowhere, nowhere, nowhere};
    const std::uint32_t turns = rate * dt_s > spacing_m / kTurns ? 1 : kTurns;
    if (!settles && (scattered(static_cast<std::uint32_t>(i)) + clock[0].turn) % turns == 0)
      place(p, s, rate * left, i);
  }
  /// The most volume per time and area that places can bring: a particle from each spacing squared, in every
  /// frame.
  static float most_m_s(float spacing_m, float dt_frame_s) { return spacing_m / dt_frame_s; }
  /// (1 - e^-x) / x
  TACTUS_HD static float mean_of_fading(float x) {
    if (x > 0.5F) return (1.F - tactus::exp(-min(x, 80.F))) / x;
    float term = 1, sum = 1;
    for (int k = 2; k <= 8; ++k) {
      term *= -x / static_cast<float>(k);
      sum += term;
    }
    return sum;
  }

 private:
  TACTUS_HD static float weight(Vec3f at, int q) {
    return ((q & 1) != 0 ? at.x : 1.F - at.x) * ((q & 2) != 0 ? at.y : 1.F - at.y) *
           ((q & 4) != 0 ? at.z : 1.F - at.z);
  }
  /// The change of weight(at, q) along d.
  TACTUS_HD static float slope(Vec3f at, Vec3f d, int q) {
    const float x = (q & 1) != 0 ? at.x : 1.F - at.x, y = (q & 2) != 0 ? at.y : 1.F - at.y,
                z = (q & 4) != 0 ? at.z : 1.F - at.z;
    return ((q & 1) != 0 ? d.x : -d.x) * y * z + ((q & 2) != 0 ? d.y : -d.y) * x * z +
           ((q & 4) != 0 ? d.z : -d.z) * x * y;
  }
  TACTUS_HD Vec3f at(const WoundPiece& p) const {
    const Vec3f base = x_m[p.node[0]];
    Vec3f x{};
    for (int q = 1; q < 8; ++q) x += weight(p.local, q) * (x_m[p.node[q]] - base);
    return base + x;
  }
  /// @param jet_m_s of what comes out in front of the piece: volume per time and area
  TACTUS_HD void place(const WoundPiece& p, const WoundState& s, float jet_m_s, Index i) const {
    const Vec3f base = x_m[p.node[0]], local = s.level < 0 ? p.rim : p.local;
    Vec3f x{}, v{}, along{}, across{};
    for (int q = 0; q < 8; ++q) {
      const Vec3f from_base = x_m[p.node[q]] - base;
      x += weight(local, q) * from_base;
      v += weight(p.local, q) * v_m_s[p.node[q]];
      along += slope(p.local, p.along, q) * from_base;
      across += slope(p.local, p.across, q) * from_base;
    }
    x += base;
    const Vec3f out = normalized(cross(along, across), Vec3f{0, 0, 0});
    // Where sides touch or overlap, a point in front of one has it as its nearest wall, and seems outside.
    const Vec3f apart = at(pieces[i ^ 1]) - at(p);
    const float gap = dot(apart, out), aside2 = dot(apart, apart) - sqr(gap);
    is_shut[i] = s.level >= 0 && gap < 2 * kWoundToWall * spacing_m && aside2 < sqr(spacing_m) ? 1 : 0;
    const Vec3f g = frame[0].gravity_m_s2, up = normalized(-g, Vec3f{0, 0, 0});
    const auto levels = static_cast<float>(s.level < 0 ? -1 - s.level : s.level);
    if (s.level >= 0) x += 0.5F * spacing_m * out;
    place_m[i] = x + levels * spacing_m * up;
    speed_m_s[i] = s.level >= 0 ? v + jet_m_s * out : v;
  }
};

/// The liquid round a place.
struct LiquidRound {
  float nearest2_m2;
  float density;  ///< over that at rest
};

/// Finds the liquid round each place, among the particles of the liquid where they are now.
struct FindLiquidRound {
  static constexpr bool kNearOnly = true;
  template <int kLanes>
  struct Own {
    Vec3f p[kLanes];
    float least2[kLanes], density[kLanes];
  };
  SmoothingKernel kernel;
  float particle_m3;
  View<const SearchParticle> places;
  View<const Vec3f> x_m;  ///< of the liquid now, by slot of its last search
  View<LiquidRound> round;
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    own.p[t] = places[i].x_m;
    own.least2[t] = 1e30F;
    own.density[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f, float, bool) const {
    const Vec3f d = x_m[j] - own.p[t];
    const float r2 = dot(d, d);
    if (!(r2 < 1e30F)) return;  // one that left
    own.least2[t] = min(own.least2[t], r2);
    own.density[t] +=
        particle_m3 * kernel.scale_1_m3() * kernel.shape(kernel.inverse_d_1_m * tactus::sqrt(r2));
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    round[i] = {own.least2[t], own.density[t]};
  }
};

/// Thread: place. Whether there is room, and where its piece tries next if not.
struct JudgePlaces {
  static constexpr Index kLevels = 24;      ///< above a piece
  static constexpr float kToLiquid = 0.9F;  ///< in spacings: nearer, there is no room
  /// Share of the density at rest: where liquid and walls round a place bring more, it is within the liquid.
  /// There, they bring 0.68, and beside a surface less than 0.3.
  static constexpr float kDense = 0.5F;
  View<const Index> order;  ///< piece of each place
  NearWalls walls;
  View<const LiquidRound> round;
  SmoothingKernel kernel;
  float spacing_m;
  View<const WoundPiece> pieces;
  View<WoundState> states;
  View<const Index> is_shut;
  View<std::uint32_t> priority_key;
  TACTUS_HD void operator()(Index k) const {
    const Index i = order[k];
    WoundState s = states[i];
    const LiquidRound liquid = round[k];
    bool no_room = is_shut[i] != 0;
    float density = liquid.density;
    for (Index w = 0; w < walls.count[k]; ++w) {
      if (walls.at(k, w).is_beside()) continue;
      const float gap_m = walls.at(k, w).distance_m;
      no_room = no_room || gap_m < kWoundToWall * spacing_m;
      density += kernel.fill(max(gap_m, 0.F));
    }
    const bool is_dense = density > kDense;
    if (!no_room && !is_dense && liquid.nearest2_m2 >= sqr(kToLiquid * spacing_m)) {
      priority_key[i] = key(s.deficit, i);
      return;
    }
    if (no_room) {
      s.level = s.level == 0 && pieces[i].at_skin != 0 ? -1 : 0;
    } else if (is_dense) {
      s.level += s.level < 0 ? -1 : 1;
      if (s.level > kLevels || s.level < -kLevels) s.level = 0;
    }
    states[i] = s;
  }
  /// > 0. The piece with the largest deficit comes first, and among equals any one.
  TACTUS_HD static std::uint32_t key(float deficit, Index i) {
    const std::uint32_t dither = scattered(static_cast<std::uint32_t>(i) ^ 0x5BD1E995U);
    const float own = deficit + static_cast<float>(dither >> 16U) * (1.F / 65536);
    return static_cast<std::uint32_t>(clamp(own + 32.F, 0.F, 127.F) * 33554432.F) | 1U;
  }
};

/// A place that has room, and no other one that has a larger deficit has it, too.
struct WoundPlace {
  std::uint32_t key = 0;
  Index piece = 0, stroke = 0;
  TACTUS_HD bool is_before(const WoundPlace& other) const {
    return key != other.key ? key > other.key : piece > other.piece;
  }
};

/// A place suppresses another one when its deficit is larger and both are too near to have room. Lists the
/// places that none suppresses, in any order.
struct BeatPlaces {
  static constexpr bool kNearOnly = true;
  template <int kLanes>
  struct Own {
    WoundPlace place[kLanes];
    Index suppressed[kLanes];
  };
  View<const Index> order;
  View<const std::uint32_t> priority_key;
  View<const WoundPiece> pieces;
  View<WoundPlace> open;
  View<std::uint32_t> open_count;
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    own.place[t] = {priority_key[order[i]], order[i], 0};
    own.suppressed[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f, float, bool) const {
    if (WoundPlace{priority_key[order[j]], order[j], 0}.is_before(own.place[t])) own.suppressed[t] = 1;
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index) const {
    WoundPlace place = own.place[t];
    if (place.key == 0 || own.suppressed[t] != 0) return;
    place.stroke = pieces[place.piece].stroke;
    open[static_cast<Index>(atomic_fetch_add(open_count[0], 1U))] = place;
  }
};

/// The buffers of a liquid for solvers that bring particles between its steps.
struct LiquidArrivals {
  View<LiquidCounters> counters;
  View<Index> count;
  View<Vec3f> x_m, v_m_s;
  View<Index> id;
  View<float> push, density_kg_m3, relative_m_s;
  Index room;  ///< for particles
  /// The liquid's last step knows nothing of it.
  TACTUS_HD void put(Index slot, Vec3f at_m, Vec3f speed_m_s, Index number) const {
    x_m[slot] = at_m;
    v_m_s[slot] = speed_m_s;
    id[slot] = number;
    push[slot] = density_kg_m3[slot] = relative_m_s[slot] = 0;
  }
};

/// One block. Per stroke, of the places that are open those that deficit most get a slot, as many as there
/// are whole particles waiting.
struct PlanWounds {
  static constexpr int kThreads = 256;
  View<const WoundPlace> open;
  View<std::uint32_t> open_count;  ///< emptied
  View<const FrameParams> frame;
  LiquidArrivals liquid;
  View<WoundLedger> ledgers;
  View<WoundClock> clock;
  View<Index> slot;     ///< of open places; -1: none
  View<Index> planned;  ///< (1) how many of those there are
  View<Index> id;       ///< (1) of the particle in slot 0
  struct Shared {
    std::uint32_t places[kStrokes];
    Index waiting[kStrokes], wanted[kStrokes], first[kStrokes];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    static_assert(kStrokes <= kThreads);
    constexpr std::uint64_t kMany = 1000000;
    const auto n = static_cast<Index>(open_count[0]);
    b.for_threads(kStrokes, [&](int t) {
      s.places[t] = 0;
      s.waiting[t] = static_cast<Index>(min(ledgers[t].waiting(), kMany));
    });
    b.for_each_thread([&](int t) {
      for (Index i = t; i < n; i += kThreads) {
        slot[i] = rank(i, n);
        atomic_add(s.places[open[i].stroke], 1U);
      }
    });
    b.on_one_thread([&] { grant(n, s); });
    b.for_each_thread([&](int t) {
      for (Index i = t; i < n; i += kThreads) {
        const Index stroke = open[i].stroke;
        slot[i] = slot[i] < s.wanted[stroke] ? s.first[stroke] + slot[i] : -1;
      }
      if (t < kStrokes && s.wanted[t] > 0) ledgers[t].emitted += static_cast<std::uint64_t>(s.wanted[t]);
    });
  }

 private:
  /// How many of the stroke come before that one. All places are looked at for each: they keep a diameter
  /// from one another, so there are some hundreds.
  TACTUS_HD Index rank(Index i, Index n) const {
    const WoundPlace own = open[i];
    Index before = 0;
    for (Index k = 0; k < n; ++k) {
      const WoundPlace other = open[k];
      before += other.stroke == own.stroke && other.is_before(own) ? 1 : 0;
    }
    return before;
  }
  /// Shares out the liquid's room to strokes, in their order.
  TACTUS_HD void grant(Index n, Shared& s) const {
    LiquidCounters c = liquid.counters[0];
    Index next = liquid.count[0];
    clock[0].turn += 1;
    if (frame[0].settles == 0)
      clock[0].time_s += static_cast<double>(frame[0].dt_s * static_cast<float>(frame[0].substeps));
    id[0] = c.next_id - next;
    planned[0] = n;
    open_count[0] = 0;
    for (Index stroke = 0; stroke < kStrokes; ++stroke) {
      s.wanted[stroke] = max(
          min(min(static_cast<Index>(s.places[stroke]), s.waiting[stroke]), liquid.room - next), Index(0));
      s.first[stroke] = next;
      next += s.wanted[stroke];
    }
    const Index all = next - liquid.count[0];
    if (all == 0) return;
    c.next_id += all;
    c.emitted += static_cast<std::uint32_t>(all);
    liquid.counters[0] = c;
    liquid.count[0] = next;
  }
};

/// Thread: open place.
struct BleedWounds {
  View<const WoundPlace> open;
  View<const Index> slot;
  View<const Index> first_id;
  View<const Vec3f> place_m, speed_m_s;
  LiquidArrivals liquid;
  View<WoundState> states;
  TACTUS_HD void operator()(Index k) const {
    const Index to = slot[k], i = open[k].piece;
    if (to < 0) return;
    liquid.put(to, place_m[i], speed_m_s[i], first_id[0] + to);
    WoundState s = states[i];
    s.deficit -= 1.F;
    s.level = max(s.level - 1, 0);
    states[i] = s;
  }
};

}  // namespace tactus
