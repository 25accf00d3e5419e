#pragma once
/// What particles see of a body's surface: the plane at its nearest point, so that the distance has slope 1
/// and what depends on it alone is a potential; and the plane across, where they are in a gap.
#include "tactus/compute/atomic.h"
#include "tactus/compute/fold.h"
#include "tactus/contact/body_wall_kernels.h"
#include "tactus/contact/surface_triangles.h"
#include "tactus/geom/neighbour_cells.h"

namespace tactus {

/// The pieces of a body's surface that are near particles, each in a place of a list.
struct NearSurface {
  NeighbourCells
      cells;  ///< of the pieces' middles; their ids are the pieces' numbers, on every device the same
  float search_reach_m;  ///< of those
  View<const Vec3i> corners;
  View<const float> radius_m;  ///< of a ball round the middle that holds the piece
  View<const Vec3f> normals;   ///< unit
  View<const PosedVertex> posed;
  TACTUS_HD TriangleCorners corners_of(Index place) const {
    const Vec3i v = corners[place];
    return {posed[v.x].x_m, posed[v.y].x_m, posed[v.z].x_m};
  }
};

/// Pieces near a run of particles that follow one another. A CPU's thread looks them up once for all of them:
/// cells are as large as the largest piece's reach, and hold far more than what is near one particle.
struct PiecesNearRun {
  static constexpr Index kLongest = 32, kMost = 1024;
  static constexpr float kWidest = 2;  ///< edge of a run's box, in reaches
  static constexpr Index kRow = kVisitLanes;
  Index first = 0, last = 0;  ///< the run, as slots of particles
  Index count = 0;            ///< of pieces; above kMost: some are not here
  float x_m[kMost], y_m[kMost], z_m[kMost], reach2_m2[kMost];
  Index slot[kMost];
  bool is_of(Index particle) const { return first <= particle && particle < last; }
  bool is_whole() const { return count <= kMost; }
  void add(Index s, Vec3f middle_m, float reach_m) {
    if (count < kMost) {
      x_m[count] = middle_m.x;
      y_m[count] = middle_m.y;
      z_m[count] = middle_m.z;
      reach2_m2[count] = sqr(reach_m);
      slot[count] = s;
    }
    ++count;
  }
  /// f(slot, to the point) for what comes within reach of it.
  template <class F>
  void for_each_within(Vec3f p, F&& f) const {
    for (Index begin = 0; begin < count; begin += kRow) {
      std::uint32_t near = 0;
#pragma omp simd reduction(| : near)
      for (int k = 0; k < kRow; ++k) {
        const float dx = p.x - x_m[begin + k], dy = p.y - y_m[begin + k], dz = p.z - z_m[begin + k];
        near |= dx * dx + dy * dy + dz * dz <= reach2_m2[begin + k] ? 1U << k : 0U;
      }
      for (near &= (2U << min(count - 1 - begin, Index(kRow - 1))) - 1U; near != 0; near &= near - 1) {
        const Index k = begin + std::countr_zero(near);
        f(slot[k], p - Vec3f{x_m[k], y_m[k], z_m[k]});
      }
    }
  }
};

/// Block: particle. Adds the nearest point of a body's surface to its walls, and the one across.
///
/// Lanes share the pieces whose balls come within reach. On a CPU one lane has them all.
struct FindBodyWalls {
  static constexpr int kThreads = 128, kGrain = PiecesNearRun::kLongest;
  View<const SearchParticle> particles;
  NearSurface surface;
  Index owner;
  float reach_m;
  NearWalls near_walls;
  View<WallHit> hits;  ///< kWallSides of each particle

  template <Index kRoom>
  struct Found {
    static constexpr Index kListed = kRoom;  ///< where more are near, cells are searched again each time
    std::uint32_t count;                     ///< of pieces within reach
    Index listed[kListed];                   ///< slots
    std::uint32_t nearest2_m2;  ///< bits of the squared distance; before it is known, an upper bound of it
    std::uint64_t side;         ///< of the particle, in 2^-30, as SideOfTied
    Index number[kThreads], place[kThreads];  ///< what each lane found
    float distance_m[kThreads];
    Vec3f n;  ///< towards the particle from the nearest point, outward
    bool found;
  };
  using Shared = Found<128>;
  struct LoopShared : Found<PiecesNearRun::kMost> {
    PiecesNearRun run;
    Index measured[PiecesNearRun::kMost], measured_count;  ///< pieces that may be the nearest
  };

  template <class Block, class S>
  TACTUS_HD void operator()(const Block& b, S& s) const {
    const Index i = b.index();
    const Vec3f p = particles[i].x_m;
    constexpr int kLanes = Block::kIsLoop ? 1 : kThreads;
    if constexpr (Block::kIsLoop) {
      if (!s.run.is_of(i)) begin_run(i, s.run);
    }
    b.on_one_thread([&] {
      s.count = 0;
      s.nearest2_m2 = std::bit_cast<std::uint32_t>(sqr(reach_m));
      s.side = 0;
    });
    b.for_threads(kLanes, [&](int lane) { list<kLanes>(p, lane, s); });
    b.for_threads(kLanes, [&](int lane) { measure<kLanes>(p, lane, s); });
    b.for_threads(kLanes, [&](int lane) { choose_nearest<kLanes>(p, lane, s); });
    fold_found<kLanes>(b, s);
    b.on_one_thread([&] { add_nearest(i, p, s); });
    if (!s.found) return;
    b.for_threads(kLanes, [&](int lane) { look_across<kLanes>(p, lane, s); });
    fold_found<kLanes>(b, s);
    b.on_one_thread([&] { add_across(i, p, s); });
  }

 private:
  static constexpr Index kNone = 0x7fffffff;

  /// The run of particles that begins with i, and what is near it.
  void begin_run(Index i, PiecesNearRun& run) const {
    const CellHash& hash = surface.cells.hash;
    run.first = i;
    run.last = i + 1;
    run.count = 0;
    Box3f box{particles[i].x_m, particles[i].x_m};
    if (!hash.holds(box.min)) return;
    const auto is_narrow = [&](Vec3f edge) {
      return max(edge.x, max(edge.y, edge.z)) <= PiecesNearRun::kWidest * reach_m;
    };
    for (const Index most = min(i + PiecesNearRun::kLongest, particles.size()); run.last < most; ++run.last) {
      const Vec3f x = particles[run.last].x_m;
      const Box3f with{min(box.min, x), max(box.max, x)};
      if (!hash.holds(x) || !is_narrow(with.extent())) break;
      box = with;
    }
    const Vec3f middle = box.center();
    const float radius_m = 1.0001F * length(box.max - middle);  // rounding
    const Vec3i one{1, 1, 1};
    surface.cells.for_each_run(hash.cell(box.min) - one, hash.cell(box.max) + one, [&](SlotRun slots) {
      for_each_in_rows(slots, middle, surface.search_reach_m + radius_m, [&](Index slot) {
        const float reach = reach_m + surface.radius_m[surface.cells.order[slot]];
        const Vec3f at = surface.cells.particles[slot].x_m, to = middle - at;
        if (dot(to, to) <= sqr(reach + radius_m)) run.add(slot, at, reach);
      });
    });
  }
  /// f(slot) of what is within reach. Most are farther away than any piece is large.
  template <class F>
  void for_each_in_rows(SlotRun run, Vec3f p, float search_m, F&& f) const {
    constexpr int kRow = kVisitLanes;  // there is room behind the last
    const float reach2_m2 = sqr(search_m);
    for (Index first = run.first; first < run.last; first += kRow) {
      std::uint32_t near = 0;
#pragma omp simd reduction(| : near)
      for (int k = 0; k < kRow; ++k) {
        const Vec3f& x = surface.cells.particles.data()[first + k].x_m;
        const float dx = p.x - x.x, dy = p.y - x.y, dz = p.z - x.z;
        near |= dx * dx + dy * dy + dz * dz <= reach2_m2 ? 1U << k : 0U;
      }
      for (near &= (2U << min(run.last - 1 - first, Index(kRow - 1))) - 1U; near != 0; near &= near - 1)
        f(first + std::countr_zero(near));
    }
  }
  /// f(slot, to the particle) for all pieces whose balls come within reach.
  template <int kLanes, class S, class F>
  TACTUS_HD void for_each_within(Vec3f p, int lane, const S& s, F&& f) const {
    if constexpr (kLanes == 1) {
      if (s.run.is_whole()) return s.run.for_each_within(p, f);
    }
    const NeighbourCells& cells = surface.cells;
    if (!cells.hash.holds(p)) return;
    const Vec3i c = cells.hash.cell(p), one{1, 1, 1};
    cells.for_each_run(c - one, c + one, [&](SlotRun run) {
      TACTUS_ROLLED
      for (Index slot = run.first + lane; slot < run.last; slot += kLanes) {
        const Vec3f to = p - cells.particles[slot].x_m;
        if (dot(to, to) <= sqr(reach_m + surface.radius_m[cells.order[slot]])) f(slot, to);
      }
    });
  }
  /// As for_each_within, once they are listed.
  template <int kLanes, class S, class F>
  TACTUS_HD void for_each_listed(Vec3f p, int lane, const S& s, F&& f) const {
    if (s.count > S::kListed) return for_each_within<kLanes>(p, lane, s, f);
    TACTUS_ROLLED
    for (Index k = lane; k < static_cast<Index>(s.count); k += kLanes)
      f(s.listed[k], p - surface.cells.particles[s.listed[k]].x_m);
  }
  template <int kLanes, class S>
  TACTUS_HD void list(Vec3f p, int lane, S& s) const {
    float bound2 = sqr(reach_m);
    for_each_within<kLanes>(p, lane, s, [&](Index slot, Vec3f to) {
      bound2 = min(bound2, dot(to, to));  // the middle is on the piece
      const std::uint32_t at =
          kLanes == 1 ? s.count++ : atomic_fetch_add(s.count, 1U);  // they may be in any order
      if (at < S::kListed) s.listed[at] = slot;
    });
    atomic_min(s.nearest2_m2, std::bit_cast<std::uint32_t>((1.F + GapOfTriangles::kTie) * bound2));
  }
  /// Whether a piece can be so near, by its ball and its plane.
  TACTUS_HD bool may_be_within(Index place, Vec3f to, float distance_m) const {
    const float plane = dot(to, surface.normals[place]), reach = 1.0001F * distance_m;  // rounding
    return !(abs(plane) > 1.001F * distance_m) && !(dot(to, to) > sqr(surface.radius_m[place] + reach));
  }
  template <int kLanes, class S>
  TACTUS_HD void measure(Vec3f p, int lane, S& s) const {
    float least2 = std::bit_cast<float>(atomic_load(s.nearest2_m2)), within_m = distance_of_tied(least2);
    if constexpr (kLanes == 1) s.measured_count = 0;
    for_each_listed<kLanes>(p, lane, s, [&](Index slot, Vec3f to) {
      const Index place = surface.cells.order[slot];
      if (!may_be_within(place, to, within_m)) return;
      if constexpr (kLanes == 1) {
        if (s.measured_count < S::kListed) s.measured[s.measured_count] = slot;
        ++s.measured_count;
      }
      const Vec3f offset = surface.corners_of(place).offset_of(p);
      const float distance2 = dot(offset, offset);
      if (!(distance2 < least2)) return;
      least2 = distance2;
      within_m = distance_of_tied(least2);
    });
    atomic_min(s.nearest2_m2, std::bit_cast<std::uint32_t>(least2));
  }
  TACTUS_HD static float distance_of_tied(float least2_m2) {
    return (1.F + GapOfTriangles::kTie) * tactus::sqrt(least2_m2);
  }
  /// Of all that may be the nearest. A CPU's lane has measured them all; a GPU's only those that were nearer
  /// than what it had seen before.
  template <int kLanes, class S, class F>
  TACTUS_HD void for_each_measured(Vec3f p, int lane, const S& s, F&& f) const {
    if constexpr (kLanes == 1) {
      if (s.measured_count <= S::kListed) {
        for (Index k = 0; k < s.measured_count; ++k)
          f(s.measured[k], p - surface.cells.particles[s.measured[k]].x_m);
        return;
      }
    }
    for_each_listed<kLanes>(p, lane, s, f);
  }
  /// Of pieces that share the nearest edge or corner, the first; all of them tell the side: GapOfTriangles.
  template <int kLanes, class S>
  TACTUS_HD void choose_nearest(Vec3f p, int lane, S& s) const {
    const float least2 = std::bit_cast<float>(s.nearest2_m2);
    const float within_m = distance_of_tied(least2);
    s.number[lane] = kNone;
    for_each_measured<kLanes>(p, lane, s, [&](Index slot, Vec3f to) {
      const Index place = surface.cells.order[slot];
      if (!may_be_within(place, to, within_m)) return;
      const TriangleCorners corners = surface.corners_of(place);
      const Vec3f offset = corners.offset_of(p);
      const float d2 = dot(offset, offset);
      if (!(d2 <= sqr(reach_m)) || !GapOfTriangles::ties(d2, least2)) return;
      const float to_plane = dot(p - corners.a, surface.normals[place]);
      const float side = clamp(to_plane / max(tactus::sqrt(d2), 1e-12F), -1.F, 1.F);
      constexpr float kUnits = 1 << 30;
      atomic_add(s.side,
                 static_cast<std::uint64_t>(static_cast<std::int64_t>(kUnits * (corners.weight(p) * side))));
      note(slot, 0.F, lane, s);
    });
  }
  template <class S>
  TACTUS_HD void note(Index slot, float distance_m, int lane, S& s) const {
    note(surface.cells.particles[slot].id, surface.cells.order[slot], distance_m, lane, s);
  }
  /// The least of distance and number.
  template <class S>
  TACTUS_HD static void note(Index number, Index place, float distance_m, int lane, S& s) {
    if (s.number[lane] != kNone &&
        (distance_m > s.distance_m[lane] || (distance_m == s.distance_m[lane] && number >= s.number[lane])))
      return;
    s.distance_m[lane] = distance_m;
    s.number[lane] = number;
    s.place[lane] = place;
  }
  template <int kLanes, class Block, class S>
  TACTUS_HD static void fold_found(const Block& b, S& s) {
    fold<kLanes>(b, kLanes, [&](int lane, int other) {
      if (s.number[other] != kNone) note(s.number[other], s.place[other], s.distance_m[other], lane, s);
    });
  }
  /// Of what all lanes found; -1: nothing.
  template <class S>
  TACTUS_HD static Index place_found(const S& s) {
    return s.number[0] == kNone ? -1 : s.place[0];
  }
  template <class S>
  TACTUS_HD void add_nearest(Index i, Vec3f p, S& s) const {
    const Index place = place_found(s);
    s.found = place >= 0;
    if (s.found)
      s.n = add(i, 0, p, place, static_cast<std::int64_t>(s.side) < 0);
    else
      for (Index side = 0; side < kWallSides; ++side) hits[kWallSides * i + side] = {-1, 0, 0};
  }
  template <int kLanes, class S>
  TACTUS_HD void look_across(Vec3f p, int lane, S& s) const {
    float within_m = reach_m;
    s.number[lane] = kNone;
    for_each_listed<kLanes>(p, lane, s, [&](Index slot, Vec3f to) {
      const Index place = surface.cells.order[slot];
      const Vec3f normal = surface.normals[place];
      if (!WallAcross::may_face(s.n, normal) || !may_be_within(place, to, within_m)) return;
      const Vec3f offset = surface.corners_of(place).offset_of(p);
      const float distance = length(offset);
      if (!(distance <= within_m) || !WallAcross::faces(s.n, normal, offset, distance)) return;
      within_m = distance;
      note(slot, distance, lane, s);
    });
  }
  template <class S>
  TACTUS_HD void add_across(Index i, Vec3f p, S& s) const {
    const Index place = place_found(s);
    if (place >= 0)
      add(i, 1, p, place, false);
    else
      hits[kWallSides * i + 1] = {-1, 0, 0};
  }
  /// Returns the normal.
  TACTUS_HD Vec3f add(Index i, Index side, Vec3f p, Index place, bool behind) const {
    const TriangleCorners corners = surface.corners_of(place);
    const Vec3f offset = corners.offset_of(p), e1 = corners.b - corners.a, e2 = corners.c - corners.a,
                area = cross(e1, e2), at = (p - corners.a) - offset;
    const float inverse = 1.F / max(dot(area, area), 1e-30F);
    WallHit hit{place, clamp(inverse * dot(cross(at, e2), area), 0.F, 1.F), 0};
    hit.c = clamp(inverse * dot(cross(e1, at), area), 0.F, 1.F - hit.b);
    const float distance = length(offset), sign = behind ? -1.F : 1.F, a = 1.F - hit.b - hit.c;
    const Vec3f n = distance > 1e-7F ? (sign / distance) * offset : surface.normals[place];
    const Vec3i v = surface.corners[place];
    const PosedVertex &p0 = surface.posed[v.x], &p1 = surface.posed[v.y], &p2 = surface.posed[v.z];
    near_walls.add(i, {n,
                       sign * distance,
                       a * p0.v_m_s + hit.b * p1.v_m_s + hit.c * p2.v_m_s,
                       owner,
                       a * p0.give_1_kg + hit.b * p1.give_1_kg + hit.c * p2.give_1_kg,
                       {},
                       side});
    hits[kWallSides * i + side] = hit;
    return n;
  }
};

}  // namespace tactus
