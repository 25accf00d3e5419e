#pragma once
/// Results of a liquid: its ledgers, its forces, and its films.
#include <cstdint>
#include <string>
#include <vector>

#include "tactus/base/math.h"
#include "tactus/base/vec.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Particle counts since the liquid was placed, and its extremes now. Exactly: placed + emitted = here +
/// taken + replaced. The oldest are replaced when newer ones need their capacity; particles of emitters for
/// which all of the capacity is too little are waiting.
struct LiquidReport {
  // Sums over particles, as integers: in any order the same.
  std::uint64_t borne =
      0;  ///< p / (rho0 d) of dfsph [m/s^2], in kBorneUnits: g times the layers that each bears
  /// Of the density over that at rest, where there is one, in kExcessUnits. No particle counts more than
  /// kMostExcess: liquid that is caught, as in an open cut, iterations don't mend.
  std::uint64_t excess = 0;
  static constexpr float kBorneUnits = 1048576.F, kExcessUnits = 1099511627776.F, kMostExcess = 0.002F;
  Index here = 0;
  std::uint32_t placed = 0, emitted = 0, taken = 0, replaced = 0, waiting = 0;
  Index fast = 0;  ///< faster than max_speed_m_s now
  float fastest_m_s = 0;
  float fastest_together_m_s = 0;  ///< of those that have at least half of the density at rest
  float densest = 0;               ///< largest density over that at rest
  /// dfsph: the sum of (u / max_speed)^4 in kQuarticUnits, where u is a particle's largest speed relative to
  /// a neighbour or a wall in reach.
  std::uint64_t quartic = 0;
  static constexpr float kQuarticUnits = 4294967296.F, kMostOverSpeed = 2;
  Vec3f low_m{1e30F, 1e30F, 1e30F}, high_m{-1e30F, -1e30F, -1e30F};  ///< box round all
  /// At most kMostOverSpeed^4, so that 10^8 particles have a sum.
  TACTUS_HD static std::uint64_t quartic_of(float u) {
    return static_cast<std::uint64_t>(sqr(sqr(min(u, kMostOverSpeed))) * kQuarticUnits);
  }
  /// Adds the report of another part of the liquid. The order of sums of integers and maxima doesn't matter.
  TACTUS_HD void add(const LiquidReport& part) {
    borne += part.borne;
    excess += part.excess;
    here += part.here;
    placed += part.placed;
    emitted += part.emitted;
    taken += part.taken;
    replaced += part.replaced;
    waiting += part.waiting;
    fast += part.fast;
    fastest_m_s = max(fastest_m_s, part.fastest_m_s);
    fastest_together_m_s = max(fastest_together_m_s, part.fastest_together_m_s);
    densest = max(densest, part.densest);
    quartic += part.quartic;
    low_m = min(low_m, part.low_m);
    high_m = max(high_m, part.high_m);
  }
};

/// Mean force of the liquid over a frame.
struct LiquidReaction {
  std::string on;  ///< "face -y" of the liquid's box, an obstacle's or body's name, or a component's label
  Vec3f force_N;
};

/// The volume ledger of all films, with what waits for the real surface. Exactly: film + stain =
/// (taken - given) particles.
struct SceneFilmReport {
  double film_m3 = 0, stain_m3 = 0;
  std::uint64_t wet_vertices = 0;
  std::uint64_t taken = 0, given = 0;  ///< particles, since the beginning; in LiquidReport, too
};

/// Thickness of film and stain at each vertex of a surface: the volume over a third of the area of its
/// triangles.
struct FilmThickness {
  std::vector<float> film_m, stain_m;
};

/// The part of an obstacle's or the real surface on which a film or a stain lies, and two rings of triangles
/// more.
struct WetObstacle {
  std::string name;
  TriangleMesh mesh;  ///< world; has normals, which are smooth over edges, too
  FilmThickness film;
};

}  // namespace tactus
