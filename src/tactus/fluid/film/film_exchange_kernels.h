#pragma once
/// Particles that become film where they touch a surface slowly, and film that becomes particles where it is
/// too thick. A particle is a whole number of units of volume, so the ledger is exact.
///
/// A particle gives its volume to the triangles round the vertex that is nearest. Many do at once: volumes
/// are integers, so their sums don't depend on the order. A particle comes from the triangles round a vertex:
/// among vertices that want to give at once, those are chosen whose keys are the largest within two rings. No
/// two of them have a neighbour in common, so each takes its neighbours' volumes alone.
#include "tactus/compute/atomic.h"
#include "tactus/fluid/film/film_kernels.h"
#include "tactus/fluid/film/film_region_kernels.h"
#include "tactus/fluid/wound_kernels.h"

namespace tactus {

/// Particles since the beginning: the film holds (taken - given) of them.
struct FilmLedger {
  std::uint32_t taken = 0, given = 0;
};

struct FilmExchangeLaw {
  float spacing_m = 0;
  float slow_m_s = 0;
  std::int64_t particle_units = 0;  ///< of volume
  float particle_m3 = 0;
  /// The film takes particles up to here. It gives them where one particle, round a vertex, lies on top of
  /// that: what was just taken stays.
  float thick_m = 0;
  /// In spacings. A particle at rest on a wall is half a spacing from it.
  static constexpr float kTouch = 0.75F, kApart = 0.9F;
};

/// A surface, with what an exchange must know of it besides.
struct FilmSkin {
  FilmSurface surface;
  View<const Vec3f> normals;   ///< unit, outward
  View<const Vec3f> last_x_m;  ///< in the frame before
  View<const FrameParams> frame;
  TACTUS_HD Vec3f velocity_m_s(Index v) const {
    const float dt_s = film_frame_s(frame[0]);
    return dt_s > 0 ? (1.F / dt_s) * (surface.x_m[v] - last_x_m[v]) : Vec3f{};
  }
  TACTUS_HD float area_m2(Index triangle) const {
    const Vec3f a = surface.x_m[surface.corners[3 * triangle]];
    return 0.5F * length(cross(surface.x_m[surface.corners[3 * triangle + 1]] - a,
                               surface.x_m[surface.corners[3 * triangle + 2]] - a));
  }
  /// The area of all triangles round a vertex.
  TACTUS_HD float fan_m2(Index v) const {
    float area = 0;
    for (Index e = surface.lists[v].begin; e < surface.lists[v].end; ++e)
      area += area_m2(surface.incident[e]);
    return area;
  }
  /// That corner of a triangle which follows v.
  TACTUS_HD Index next(Index triangle, Index v) const {
    for (int k = 0; k < 2; ++k)
      if (surface.corners[3 * triangle + k] == v) return surface.corners[3 * triangle + k + 1];
    return surface.corners[3 * triangle];
  }
};

/// For each particle: the vertex nearest to where it is now, if the particle touches it slowly.
struct FindFilmVertex {
  static constexpr bool kNearOnly = true;
  template <int kLanes>
  struct Own {
    Vec3f p[kLanes];
    float least2[kLanes];
    Index vertex[kLanes];
  };
  FilmExchangeLaw law;
  FilmSkin skin;
  View<const Index> order;       ///< vertex of each slot of their search
  View<const Vec3f> x_m, v_m_s;  ///< of particles, by slot
  View<Index> target;            ///< by slot; -1: none
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    own.p[t] = x_m[i];
    own.least2[t] = 1e30F;
    own.vertex[t] = -1;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f, float, bool) const {
    const Index v = order[j];
    const Vec3f d = own.p[t] - skin.surface.x_m[v];
    const float r2 = dot(d, d);
    if (r2 < own.least2[t] || (r2 == own.least2[t] && v < own.vertex[t])) {
      own.least2[t] = r2;
      own.vertex[t] = v;
    }
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    const Index v = own.vertex[t];
    target[i] = -1;
    if (v < 0) return;
    const float above = dot(own.p[t] - skin.surface.x_m[v], skin.normals[v]);
    const Vec3f speed = v_m_s[i] - skin.velocity_m_s(v);
    if (!(abs(above) < FilmExchangeLaw::kTouch * law.spacing_m && dot(speed, speed) < sqr(law.slow_m_s)))
      return;
    target[i] = v;
  }
};

/// Thread: slot of a particle. The vertex keeps the least id, where its film has room.
struct ClaimVertices {
  FilmExchangeLaw law;
  FilmSkin skin;
  View<const Index> id;
  View<const std::int64_t> volume;
  View<Index> target;
  View<std::uint32_t> claim;  ///< 0: of nobody
  TACTUS_HD void operator()(Index i) const {
    const Index v = target[i];
    if (v < 0) return;
    const float area = (1.F / 3) * skin.fan_m2(v), m3 = kFilmUnit_m3 * static_cast<float>(volume[v]);
    if (area > 0 && m3 <= law.thick_m * area)
      atomic_max(claim[v], key(id[i]));
    else
      target[i] = -1;  // others make it no thinner
  }
  TACTUS_HD static std::uint32_t key(Index id) { return ~static_cast<std::uint32_t>(id); }
};

/// Thread: vertex of the region. Where it has a key, the largest one within two rings. Few have one.
struct LargestKey {
  FilmSurface surface;
  View<const Index> region;
  View<const std::uint64_t> key;
  View<std::uint64_t> most;  ///< by the region's numbers
  TACTUS_HD void operator()(Index i) const {
    const Index v = region[i];
    std::uint64_t m = key[v];
    if (m != 0)
      for (Index e = surface.lists[v].begin; e < surface.lists[v].end; ++e)
        for (int k = 0; k < 3; ++k) m = max(m, within_ring(surface.corners[3 * surface.incident[e] + k]));
    most[i] = m;
  }

 private:
  TACTUS_HD std::uint64_t within_ring(Index v) const {
    std::uint64_t m = key[v];
    for (Index e = surface.lists[v].begin; e < surface.lists[v].end; ++e)
      for (int k = 0; k < 3; ++k) m = max(m, key[surface.corners[3 * surface.incident[e] + k]]);
    return m;
  }
};

/// Thread: slot of a particle. The one whose claim the vertex kept takes it back: claims are nobody's again.
struct TakeParticles {
  FilmExchangeLaw law;
  FilmSkin skin;
  View<const Index> id;
  View<Index> target;
  View<std::uint32_t> claim;
  View<Vec3f> x_m;
  FilmGains film;
  View<LiquidCounters> counters;
  View<FilmLedger> ledger;
  TACTUS_HD void operator()(Index i) const {
    const Index v = target[i];
    // Others read a claim that isn't theirs, before it is taken back or after.
    if (v < 0 || atomic_load(claim[v]) != ClaimVertices::key(id[i])) return;
    atomic_store(claim[v], 0U);
    const float per_m2 = static_cast<float>(law.particle_units) / (3 * skin.fan_m2(v));
    std::int64_t left = law.particle_units;
    for (Index e = skin.surface.lists[v].begin; e < skin.surface.lists[v].end; ++e) {
      const Index t = skin.surface.incident[e];
      const auto share = static_cast<std::int64_t>(0.999F * per_m2 * skin.area_m2(t));
      for (int k = 0; k < 3; ++k) {
        const Index corner = skin.surface.corners[3 * t + k];
        if (corner == v) continue;
        film.give(corner, share);
        left -= share;
      }
    }
    film.give(v, left);
    const float nowhere = std::bit_cast<float>(0x7FC00000U);
    x_m[i] = {nowhere, nowhere, nowhere};
    target[i] = -1;
    atomic_add(counters[0].taken, 1U);
    atomic_add(ledger[0].taken, 1U);
  }
};

/// Thread: vertex of the region. Where the film is too thick, and there is a particle's volume round the
/// vertex: its height as a key.
struct KeyThickFilm {
  FilmExchangeLaw law;
  FilmSkin skin;
  View<const Index> region;
  View<const float> height_m;
  View<const std::int64_t> volume;
  View<std::uint64_t> key;  ///< 0 outside of the region
  TACTUS_HD void operator()(Index i) const {
    const Index v = region[i];
    if (!(height_m[v] > law.thick_m)) return;
    const float area = skin.fan_m2(v);
    if (!(area > 0 && height_m[v] > law.thick_m + 1.2F * law.particle_m3 / area)) return;
    std::int64_t all = volume[v];
    for (Index e = skin.surface.lists[v].begin; e < skin.surface.lists[v].end; ++e)
      all += volume[skin.next(skin.surface.incident[e], v)];
    if (all < law.particle_units) return;
    key[v] = std::uint64_t{std::bit_cast<std::uint32_t>(height_m[v])} << 32U | ~static_cast<std::uint32_t>(v);
  }
};

/// Thread: vertex of the region. Flags those that give, and takes keys away.
struct FlagGivers {
  View<const Index> region;
  View<const std::uint64_t> most;
  View<std::uint64_t> key;
  View<Index> flag;
  TACTUS_HD void operator()(Index i) const {
    const Index v = region[i];
    flag[i] = key[v] != 0 && most[i] == key[v] ? 1 : 0;
    key[v] = 0;
  }
};

/// Thread: vertex that gives. Where a particle would come from it.
struct PlaceGiven {
  FilmExchangeLaw law;
  FilmSkin skin;
  View<const Index> region;
  View<Index> giver;  ///< a number in the region, then the vertex
  View<Vec3f> place_m;
  TACTUS_HD void operator()(Index k) const {
    const Index v = region[giver[k]];
    giver[k] = v;
    place_m[k] = skin.surface.x_m[v] + 0.5F * law.spacing_m * skin.normals[v];
  }
};

/// Thread: slot of a place. Flags it if no particle is near.
struct FlagGiven {
  FilmExchangeLaw law;
  View<const LiquidRound> round;
  View<Index> flag;
  TACTUS_HD void operator()(Index k) const {
    flag[k] = round[k].nearest2_m2 >= sqr(FilmExchangeLaw::kApart * law.spacing_m) ? 1 : 0;
  }
};

/// As many particles as the liquid has room for.
struct PlanGiven {
  View<const Index> flagged;
  LiquidArrivals liquid;
  View<Index> planned, slot, id;  ///< (1) each
  View<FilmLedger> ledger;
  TACTUS_HD void operator()(Index) const {
    LiquidCounters c = liquid.counters[0];
    const Index n = min(flagged[0], liquid.room - liquid.count[0]);
    planned[0] = n;
    slot[0] = liquid.count[0];
    id[0] = c.next_id;
    c.next_id += n;
    c.emitted += static_cast<std::uint32_t>(n);
    ledger[0].given += static_cast<std::uint32_t>(n);
    liquid.counters[0] = c;
    liquid.count[0] += n;
  }
};

/// Thread: particle that comes. They come in the order of their places, as the list of givers has none.
struct GiveParticles {
  FilmExchangeLaw law;
  FilmSkin skin;
  View<const Index> list;   ///< slots of places
  View<const Index> order;  ///< number of each slot's place
  View<const Index> giver, slot, id;
  View<const Vec3f> place_m;
  View<std::int64_t> volume;
  LiquidArrivals liquid;
  TACTUS_HD void operator()(Index k) const {
    const Index place = order[list[k]], v = giver[place], to = slot[0] + k;
    liquid.put(to, place_m[place], skin.velocity_m_s(v), id[0] + k);
    std::int64_t left = law.particle_units - take(v, law.particle_units);
    for (Index e = skin.surface.lists[v].begin; e < skin.surface.lists[v].end; ++e)
      left -= take(skin.next(skin.surface.incident[e], v), left);
  }

 private:
  TACTUS_HD std::int64_t take(Index v, std::int64_t wanted) const {
    const std::int64_t units = min(volume[v], wanted);
    volume[v] -= units;
    return units;
  }
};

}  // namespace tactus
