#pragma once
/// What particles see of a body's surface: the plane at its nearest point, so that the distance has slope 1
/// and what depends on it alone is a potential; and the plane across, where they are in a gap.
#include "tactus/compute/atomic.h"
#include "tactus/compute/fold.h"
#include "tactus/contact/near_surface.h"

namespace tactus {

/// Block: particle. Adds the nearest point of a body's surface to its walls, and the one across.
///
/// Lanes share the pieces whose balls come within reach. On a CPU one lane has them all, and a run of
/// particles looks them up together.
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
    Index measured[PiecesNearRun::kMost], measured_count;  ///< slots of pieces that may be the nearest
  };

  template <class Block, class S>
  TACTUS_HD void operator()(const Block& b, S& s) const {
    const Index i = b.index();
    const Vec3f p = particles[i].x_m;
    constexpr int kLanes = Block::kIsLoop ? 1 : kThreads;
    if constexpr (Block::kIsLoop) {
      if (!s.run.is_of(i)) s.run.begin(i, particles, surface, reach_m);
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
