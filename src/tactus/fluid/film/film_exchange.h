#pragma once
/// The exchange between a film and the particles of a liquid.
#include "tactus/fluid/film/film.h"
#include "tactus/fluid/film/film_exchange_kernels.h"
#include "tactus/geom/search/neighbour_search.h"

namespace tactus {

struct FilmExchangeSettings {
  float spacing_m = 0;  ///< d of the liquid's particles
  float gravity_m_s2 = 9.81F;
  float slow_m_s = 0.5F;    ///< a particle that is faster, seen from the surface, stays one
  float reach_m = 0;        ///< a particle's nearest vertex is at most so far: d and an edge of the surface
  Index max_particles = 0;  ///< that the liquid has room for
  bool is_still = false;    ///< the surface never moves: its vertices are sorted at the start alone
  /// Its vertices are others each time: last_places_m() is filled in before find_touching().
  bool is_new = false;
};

/// Between two steps of a liquid that is in one part: particles that touch a surface slowly become film, and
/// film that is too thick becomes particles: thicker than 0.7 d, and than a puddle is at its contact angle.
/// Once a frame, after the film's step. Asynchronous, may be recorded.
class FilmExchange {
 public:
  /// @throws Error naming the setting that is out of range.
  FilmExchange(ExecContext& ctx, const FilmExchangeSettings& settings, const Film& film);

  /// Where the surface is before the first frame.
  void start(ExecContext& ctx, const FilmSurface& surface);
  /// New vertices, where a cut made some: they stand still in the coming frame.
  void add_vertices(ExecContext& ctx, const FilmSurface& surface, Index first, Index end);
  /// Where the vertices were a frame before.
  View<Vec3f> last_places_m() { return last_x_m_.view(); }
  /// All that later frames depend on. Synchronizes. @throws Error.
  void archive(ExecContext& ctx, StateArchive& a);
  /// What the film and its surface are in this frame.
  FilmSkin skin(const FilmSurface& surface, View<const Vec3f> normals, View<const FrameParams> frame) const {
    return {surface, normals, last_x_m_.const_view(), frame};
  }
  /// Finds the particles that touch, and once the film has flowed, the vertices that have too much. Neither
  /// changes film or liquid, nor needs the other: they may run at the same time, and those of several films.
  /// @param search of the liquid's last step
  void find_touching(ExecContext& ctx, const FilmSkin& skin, const NeighbourSearch& search,
                     const LiquidArrivals& liquid);
  void find_givers(ExecContext& ctx, const Film& film, const FilmSkin& skin, const NeighbourSearch& search,
                   const LiquidArrivals& liquid);
  /// After both: takes and gives. One film after the other; particles that another took stay with it.
  void run(ExecContext& ctx, Film& film, const FilmSkin& skin, const NeighbourSearch& search,
           const LiquidArrivals& liquid);

  /// Between frames: how thick puddles are follows gravity, > 0. A recorded frame must be recorded anew.
  /// @throws Error naming it.
  void set_gravity_m_s2(float gravity_m_s2, const Film& film);
  /// A film that is thicker than this becomes particles.
  float thick_m() const { return law_.thick_m; }
  /// The volume of a particle, in units of kFilmUnit_m3.
  std::int64_t particle_units() const { return law_.particle_units; }
  /// (1)
  View<const FilmLedger> ledger() const { return ledger_.const_view(); }

 private:
  FilmExchangeSettings settings_;
  FilmExchangeLaw law_;
  NeighbourSearch vertices_, places_;
  Buffer<Index> target_;
  Buffer<std::uint32_t> layers_;
  Buffer<std::uint64_t> key_, most_;
  Buffer<Vec3f> place_m_, last_x_m_;
  Buffer<LiquidRound> round_;
  Buffer<Index> flag_, list_, giver_, givers_, flagged_, planned_, slot_, id_;
  Buffer<FilmLedger> ledger_;
};

}  // namespace tactus
