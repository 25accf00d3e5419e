#pragma once
/// Walls of particles at a body's surface: the plane at its nearest point, so that the distance has slope 1
/// and a function of it alone is a potential; and the plane across, where they are in a gap.
#include "tactus/compute/atomic.h"
#include "tactus/compute/fold.h"
#include "tactus/contact/walls/near_surface.h"

namespace tactus {

/// The particles that may be near a piece. A GPU gives each of them a block of FindBodyWalls, which takes its
/// time where nothing is near, too.
struct ChooseNearParticles {
  View<const SearchParticle> particles;
  NearSurface surface;
  float reach_m;
  View<WallHit> hits;  ///< as FindBodyWalls': of those that are not chosen, none
  View<std::uint32_t> count;
  View<Index> chosen;  ///< in any order
  TACTUS_HD void operator()(Index i) const {
    if (may_be_near(particles[i].x_m)) {
      chosen[static_cast<Index>(atomic_fetch_add(count[0], 1U))] = i;
    } else {
      for (Index side = 0; side < kWallSides; ++side) hits[kWallSides * i + side] = {-1, 0, 0};
    }
  }

 private:
  TACTUS_HD bool may_be_near(Vec3f p) const {
    bool any = false;
    if (surface.cells.hash.holds(p))
      surface.for_each_run(p, p, surface.reach_to_middle_m(reach_m),
                           [&](SlotRun run) { any = any || run.first < run.last; });
    return any;
  }
};

/// Block: particle. Adds the nearest point of a body's surface to its walls, and the one across.
///
/// Lanes share the pieces whose balls come within reach. On a CPU one lane has them all, and a run of
/// particles looks them up together.
struct FindBodyWalls {
  static constexpr int kThreads = 128, kGrain = PiecesNearRun::kLongest;
  View<const SearchParticle> particles;
  NearSurface surface;
  Index collider;
  float reach_m;
  NearWalls near_walls;
  View<WallHit> hits;             ///< kWallSides of each particle
  View<const Index> chosen = {};  ///< particles of the blocks; empty: all

  struct Shared {
    static constexpr Index kListed = 128;  ///< where more are near, cells are searched again each time
    std::uint32_t count;                   ///< of pieces within reach; of those of a run, 1 stands for any
    Index listed[kListed];                 ///< slots, but of those of a run
    std::uint32_t nearest2_m2;  ///< bits of the squared distance; before it is known, an upper bound of it
    std::uint64_t side;         ///< of the particle, in 2^-30, as SideOfTied
    Index number[kThreads], place[kThreads];  ///< the nearest of each lane
    float distance_m[kThreads];
    Vec3f n;  ///< towards the particle from the nearest point, outward
    bool found;
  };
  struct LoopShared : Shared {
    static constexpr Index kMeasured = 128;
    PiecesNearRun run;
    Index middle;  ///< slot of the run's piece within reach whose middle is nearest; or -1
    Index measured[kMeasured], measured_count;  ///< slots of pieces that may be the nearest
    float measured_m2[kMeasured];               ///< their squared distances
  };

  template <class Block, class S>
  TACTUS_HD void operator()(const Block& b, S& s) const {
    const Index i = chosen.empty() ? b.index() : chosen[b.index()];
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
  /// A triangle that WallAcross takes leans by at most 30 degrees. Both are a little above cos 30° and 1 /
  /// cos 30°.
  static constexpr float kAboveCos30 = 0.867F, kAbovePerCos30 = 1.155F;

  /// f(slot, to the particle) for all pieces whose balls come within reach.
  template <int kLanes, class F>
  TACTUS_HD void for_each_within(Vec3f p, int lane, F&& f) const {
    const NeighbourCells& cells = surface.cells;
    if (!cells.hash.holds(p)) return;
    surface.for_each_run(p, p, surface.reach_to_middle_m(reach_m), [&](SlotRun run) {
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
    if (s.count > S::kListed) return for_each_within<kLanes>(p, lane, f);
    TACTUS_ROLLED
    for (Index k = lane; k < static_cast<Index>(s.count); k += kLanes)
      f(s.listed[k], p - surface.cells.particles[s.listed[k]].x_m);
  }
  /// f(slot, place) for those without beyond(to the particle, normal, radius) > 0.
  template <int kLanes, class S, class B, class F>
  TACTUS_HD void for_each_that(Vec3f p, int lane, const S& s, B&& beyond, F&& f) const {
    if constexpr (kLanes == 1) {
      if (s.run.is_whole())
        return s.run.for_each_that(p, beyond, [&](Index slot, Vec3f) { f(slot, surface.cells.order[slot]); });
    }
    for_each_listed<kLanes>(p, lane, s, [&](Index slot, Vec3f to) {
      const Index place = surface.cells.order[slot];
      if (!(beyond(to, surface.normals[place], surface.radius_m[place]) > 0.F)) f(slot, place);
    });
  }
  template <int kLanes, class S>
  TACTUS_HD void list(Vec3f p, int lane, S& s) const {
    float bound2 = sqr(reach_m);
    if constexpr (kLanes == 1) {
      s.middle = -1;
      if (s.run.is_whole()) {
        const PiecesNearRun::NearestMiddle nearest = s.run.nearest_middle(p, bound2);
        s.count = nearest.is_any ? 1 : 0;
        s.middle = nearest.slot;
        s.nearest2_m2 = std::bit_cast<std::uint32_t>((1.F + GapOfTriangles::kTie) * nearest.distance2_m2);
        return;
      }
    }
    for_each_within<kLanes>(p, lane, [&](Index slot, Vec3f to) {
      bound2 = min(bound2, dot(to, to));  // the middle is on the piece
      const std::uint32_t at =
          kLanes == 1 ? s.count++ : atomic_fetch_add(s.count, 1U);  // they may be in any order
      if (at < S::kListed) s.listed[at] = slot;
    });
    atomic_min(s.nearest2_m2, std::bit_cast<std::uint32_t>((1.F + GapOfTriangles::kTie) * bound2));
  }
  /// > 0: a piece can't be so near, by its ball and its plane.
  TACTUS_HD static float beyond(Vec3f to, Vec3f normal, float radius_m, float distance_m) {
    const float plane = dot(to, normal), reach = 1.0001F * distance_m;  // rounding
    return max(abs(plane) - 1.001F * distance_m, dot(to, to) - sqr(radius_m + reach));
  }
  TACTUS_HD float distance2_m2(Index place, Vec3f p) const {
    const Vec3f offset = surface.corners_of(place).offset_of(p);
    return dot(offset, offset);
  }
  template <int kLanes, class S>
  TACTUS_HD void measure(Vec3f p, int lane, S& s) const {
    float least2 = std::bit_cast<float>(atomic_load(s.nearest2_m2));
    if constexpr (kLanes == 1) {
      s.measured_count = 0;
      if (s.count == 0) return;
      // The piece of the nearest middle is near: few others can be nearer.
      if (s.middle >= 0) least2 = min(least2, distance2_m2(surface.cells.order[s.middle], p));
    }
    float within_m = distance_of_tied(least2);
    const auto is_beyond = [&](Vec3f to, Vec3f normal, float radius_m) {
      return beyond(to, normal, radius_m, within_m);
    };
    for_each_that<kLanes>(p, lane, s, is_beyond, [&](Index slot, Index place) {
      const float distance2 = distance2_m2(place, p);
      if constexpr (kLanes == 1) {
        if (s.measured_count < S::kMeasured) {
          s.measured[s.measured_count] = slot;
          s.measured_m2[s.measured_count] = distance2;
        }
        ++s.measured_count;
      }
      if (!(distance2 < least2)) return;
      least2 = distance2;
      within_m = distance_of_tied(least2);
    });
    atomic_min(s.nearest2_m2, std::bit_cast<std::uint32_t>(least2));
  }
  TACTUS_HD static float distance_of_tied(float least2_m2) {
    return (1.F + GapOfTriangles::kTie) * tactus::sqrt(least2_m2);
  }
  /// f(slot, place, squared distance) for all that tie with the nearest. A CPU's lane has measured them all;
  /// a GPU's only those that were nearer than all that it had seen before.
  template <int kLanes, class S, class F>
  TACTUS_HD void for_each_tied(Vec3f p, int lane, const S& s, F&& f) const {
    const float least2 = std::bit_cast<float>(s.nearest2_m2);
    const float within_m = distance_of_tied(least2);
    const auto ties = [&](float d2) { return d2 <= sqr(reach_m) && GapOfTriangles::ties(d2, least2); };
    const auto is_beyond = [&](Vec3f to, Vec3f normal, float radius_m) {
      return beyond(to, normal, radius_m, within_m);
    };
    if constexpr (kLanes == 1) {
      if (s.measured_count <= S::kMeasured) {
        for (Index k = 0; k < s.measured_count; ++k) {
          if (!ties(s.measured_m2[k])) continue;
          const Index slot = s.measured[k], place = surface.cells.order[slot];
          const Vec3f to = p - surface.cells.particles[slot].x_m;
          if (!(is_beyond(to, surface.normals[place], surface.radius_m[place]) > 0.F))
            f(slot, place, s.measured_m2[k]);
        }
        return;
      }
    }
    for_each_that<kLanes>(p, lane, s, is_beyond, [&](Index slot, Index place) {
      const float d2 = distance2_m2(place, p);
      if (ties(d2)) f(slot, place, d2);
    });
  }
  /// Chooses the first of the pieces that share the nearest edge or corner; all of them decide the side:
  /// GapOfTriangles.
  template <int kLanes, class S>
  TACTUS_HD void choose_nearest(Vec3f p, int lane, S& s) const {
    s.number[lane] = kNone;
    for_each_tied<kLanes>(p, lane, s, [&](Index slot, Index place, float d2) {
      const TriangleCorners corners = surface.corners_of(place);
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
  /// Place of the piece that all lanes found; -1: none.
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
    const auto is_beyond = [&, n = s.n](Vec3f to, Vec3f normal, float radius_m) {
      // Where it faces the particle, its nearest point is no farther than that.
      const float facing_m = kAbovePerCos30 * dot(to, normal) + 0.01F * reach_m;  // rounding
      return max(dot(n, normal) - kAboveCos30, beyond(to, normal, radius_m, min(within_m, facing_m)));
    };
    for_each_that<kLanes>(p, lane, s, is_beyond, [&](Index slot, Index place) {
      const Vec3f normal = surface.normals[place];
      if (!WallAcross::may_face(s.n, normal)) return;
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
                       collider,
                       a * p0.inverse_mass_1_kg + hit.b * p1.inverse_mass_1_kg + hit.c * p2.inverse_mass_1_kg,
                       {},
                       side});
    hits[kWallSides * i + side] = hit;
    return n;
  }
};

}  // namespace tactus
