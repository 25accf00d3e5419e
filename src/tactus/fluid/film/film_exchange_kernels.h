#pragma once
/// Particles that become film where they touch a surface slowly, and film that becomes particles where it is
/// too thick. A particle is a whole number of units of volume, so the ledger is exact.
///
/// A particle gives its volume to the triangles round the vertex that is nearest. Many do at once, layer upon
/// layer: volumes are integers, so their sums don't depend on the order. A particle comes from the triangles
/// round a vertex: among vertices that want to give at once, those are chosen whose keys are the largest
/// within two rings. No two of them have a neighbour in common, so each takes its neighbours' volumes alone.
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
  /// that: liquid that was just taken stays.
  float thick_m = 0;
  /// On a floor the film spreads by itself. It holds so much there, if that is more.
  float thick_on_floor_m = 0;
  /// In spacings. A particle at rest on a wall is half a spacing from it.
  static constexpr float kTouch = 0.75F, kApart = 0.9F;
  /// Layers of particles above a vertex that may become film in a frame.
  static constexpr Index kLayers = 8;
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
  /// As thick as the film may be at a vertex, however small particles are.
  TACTUS_HD float most_m(const FilmExchangeLaw& law, Vec3f normal) const {
    const Vec3f g = frame[0].gravity_m_s2;
    const float into = -dot(normal, g), whole = length(g);
    return law.thick_m + (into > 0 ? into / whole * (law.thick_on_floor_m - law.thick_m) : 0.F);
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

/// For each particle: the vertex nearest to where it is now, if the particle moves slowly above it, and how
/// many layers are below.
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
  View<const SearchParticle> vertices;  ///< by slot of their search
  View<const Vec3f> x_m, v_m_s;         ///< of particles, by slot
  View<Index> target;                   ///< by slot: kLayers times the vertex, and the layer; -1: none
  View<std::uint32_t> layers;           ///< particles in each, emptied before
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    own.p[t] = x_m[i];
    own.least2[t] = 1e30F;
    own.vertex[t] = -1;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f, float, bool) const {
    const SearchParticle vertex = load_constant(vertices, j);
    const Vec3f d = own.p[t] - vertex.x_m;
    const float r2 = dot(d, d);
    if (r2 < own.least2[t] || (r2 == own.least2[t] && vertex.id < own.vertex[t])) {
      own.least2[t] = r2;
      own.vertex[t] = vertex.id;
    }
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    const Index v = own.vertex[t];
    target[i] = -1;
    if (v < 0) return;
    const float above = dot(own.p[t] - skin.surface.x_m[v], skin.normals[v]) / law.spacing_m;
    const Vec3f speed = v_m_s[i] - skin.velocity_m_s(v);
    if (!(above > -FilmExchangeLaw::kTouch && above < FilmExchangeLaw::kLayers &&
          dot(speed, speed) < sqr(law.slow_m_s)))
      return;
    target[i] = FilmExchangeLaw::kLayers * v + (above > 0 ? floor_to_int(above) : 0);
    atomic_add(layers[target[i]], 1U);
  }
};

/// Thread: slot of a particle. It becomes film if it touches the wall, or the film as the layers below it
/// make it, and there is room in that: for a part of a layer, some of it are taken, as their ids say. One
/// that another film took since is nowhere (NaN), where no comparison holds.
struct ChooseTaken {
  FilmExchangeLaw law;
  FilmSkin skin;
  View<const std::int64_t> volume;
  View<const std::uint32_t> layers;
  View<const Vec3f> x_m;
  View<const Index> id;
  View<Index> target;  ///< -2 minus itself: not taken
  TACTUS_HD void operator()(Index i) const {
    const Index was = target[i];
    if (was < 0) return;
    const Index v = was / FilmExchangeLaw::kLayers, layer = was % FilmExchangeLaw::kLayers;
    const float area = (1.F / 3) * skin.fan_m2(v),
                most_m3 = max(law.thick_m * area, skin.most_m(law, skin.normals[v]) * area - law.particle_m3),
                spacing_m3 = law.spacing_m * area,
                above = dot(x_m[i] - skin.surface.x_m[v], skin.normals[v]) / law.spacing_m;
    float m3 = kFilmUnit_m3 * static_cast<float>(volume[v]), layer_m3 = 0;
    bool is_taken = area > 0;
    for (Index k = 0; k <= layer && is_taken; ++k) {
      m3 += layer_m3;
      layer_m3 = law.particle_m3 * static_cast<float>(layers[FilmExchangeLaw::kLayers * v + k]);
      // Others lie in the middle of their layers; a layer's part below a particle is as large as it is high.
      const float within = k == layer ? max(above - static_cast<float>(k), 0.F) : 0.5F,
                  height = k == layer ? above : static_cast<float>(k) + 0.5F;
      is_taken = m3 <= most_m3 && (height - FilmExchangeLaw::kTouch) * spacing_m3 < m3 + within * layer_m3;
    }
    if (!is_taken || share_of(id[i]) * layer_m3 > most_m3 - m3 + law.particle_m3) target[i] = -2 - was;
  }

 private:
  /// Ids that follow one another are spread over 0 to 1.
  TACTUS_HD static float share_of(Index id) {
    constexpr std::uint32_t kGolden = 2654435769U;
    return static_cast<float>(static_cast<std::uint32_t>(id) * kGolden >> 8U) * (1.F / 16777216);
  }
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

/// Thread: slot of a particle. Its volume goes round its vertex if it was chosen.
struct TakeParticles {
  FilmExchangeLaw law;
  FilmSkin skin;
  View<const Index> target;
  View<std::uint32_t> layers;  ///< emptied
  View<Vec3f> x_m;
  FilmGains film;
  View<LiquidCounters> counters;
  View<FilmLedger> ledger;
  TACTUS_HD void operator()(Index i) const {
    if (target[i] == -1) return;
    const bool is_taken = target[i] >= 0;
    const Index was = is_taken ? target[i] : -2 - target[i], v = was / FilmExchangeLaw::kLayers;
    atomic_store(layers[was], 0U);
    if (!is_taken) return;
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
    if (!(area > 0 &&
          height_m[v] > max(law.thick_m + 1.2F * law.particle_m3 / area, skin.most_m(law, skin.normals[v]))))
      return;
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
