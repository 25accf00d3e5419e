#include "tactus/fluid/film/film_exchange.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tactus/base/error.h"

namespace tactus {
namespace {

FilmExchangeLaw law_of(const FilmExchangeSettings& s, const FilmLaw& film) {
  const auto require = [](bool ok, const char* what, float value) {
    if (!ok)
      throw Error(std::string("exchange with a film: ") + what + " is " + std::to_string(value) +
                  ", must be > 0");
  };
  require(s.spacing_m > 0, "spacing_m", s.spacing_m);
  require(s.gravity_m_s2 > 0, "gravity_m_s2", s.gravity_m_s2);
  require(s.slow_m_s > 0, "slow_m_s", s.slow_m_s);
  require(s.reach_m > 0, "reach_m", s.reach_m);
  require(s.max_particles > 0, "max_particles", static_cast<float>(s.max_particles));
  const float particle_m3 = s.spacing_m * s.spacing_m * s.spacing_m;
  // A wide puddle is (2 sigma (1 - cos(angle)) / (rho g))^(1/2) thick; a small one, up to a fifth more.
  const float puddle_m = std::sqrt(2 * film.hold_N_m / (film.density_kg_m3 * s.gravity_m_s2));
  return {.spacing_m = s.spacing_m,
          .slow_m_s = s.slow_m_s,
          .particle_units = std::llround(double{particle_m3} * double{kFilmUnits_1_m3}),
          .particle_m3 = particle_m3,
          .thick_m = std::max(0.7F * s.spacing_m, 1.2F * puddle_m),
          .thick_on_floor_m = std::max(0.7F * s.spacing_m, 2 * puddle_m)};
}

}  // namespace

FilmExchange::FilmExchange(ExecContext& ctx, const FilmExchangeSettings& settings, const Film& film)
    : settings_(settings),
      law_(law_of(settings, film.law())),
      vertices_(ctx.device(), {.max_particles = film.max_vertices(), .reach_m = settings.reach_m}),
      places_(ctx.device(), {.max_particles = film.max_vertices(), .reach_m = settings.spacing_m}),
      target_(ctx.device(), settings.max_particles),
      layers_(ctx.device(), FilmExchangeLaw::kLayers * std::int64_t{film.max_vertices()}),
      key_(ctx.device(), film.max_vertices()),
      most_(ctx.device(), film.max_vertices()),
      place_m_(ctx.device(), film.max_vertices()),
      last_x_m_(ctx.device(), film.max_vertices()),
      round_(ctx.device(), film.max_vertices()),
      flag_(ctx.device(), film.max_vertices()),
      list_(ctx.device(), film.max_vertices()),
      giver_(ctx.device(), film.max_vertices()),
      givers_(ctx.device(), 1),
      flagged_(ctx.device(), 1),
      planned_(ctx.device(), 1),
      slot_(ctx.device(), 1),
      id_(ctx.device(), 1),
      ledger_(ctx.device(), 1) {
  ctx.reserve_scratch(film.max_vertices());
  ctx.fill_bytes(ledger_.view(), 0);
  ctx.fill_bytes(last_x_m_.view(), 0);
  ctx.fill_bytes(layers_.view(), 0);
  ctx.fill_bytes(key_.view(), 0);
}

void FilmExchange::set_gravity_m_s2(float gravity_m_s2, const Film& film) {
  FilmExchangeSettings changed = settings_;
  changed.gravity_m_s2 = gravity_m_s2;
  law_ = law_of(changed, film.law());
  settings_ = changed;
}

void FilmExchange::start(ExecContext& ctx, const FilmSurface& surface) {
  ctx.copy(surface.x_m, last_x_m_.view().part(0, surface.x_m.size()));
  if (settings_.is_still) vertices_.build(ctx, surface.x_m, {}, surface.vertices);
}

void FilmExchange::add_vertices(ExecContext& ctx, const FilmSurface& surface, Index first, Index end) {
  if (end > first) ctx.copy(surface.x_m.part(first, end - first), last_x_m_.view().part(first, end - first));
}

void FilmExchange::archive(ExecContext& ctx, StateArchive& a) {
  a.buffer(ctx, "film's last places", last_x_m_);
  a.buffer(ctx, "film's ledger", ledger_);
}

void FilmExchange::find_touching(ExecContext& ctx, const FilmSkin& skin, const NeighbourSearch& search,
                                 const LiquidArrivals& liquid) {
  if (!settings_.is_still) vertices_.build(ctx, skin.surface.x_m, {}, skin.surface.vertices);
  search.visit(ctx, "film/touch", vertices_,
               FindFilmVertex{law_, skin, vertices_.cells().particles, View<const Vec3f>(liquid.x_m),
                              View<const Vec3f>(liquid.v_m_s), target_.view(), layers_.view()});
}

void FilmExchange::find_givers(ExecContext& ctx, const Film& film, const FilmSkin& skin,
                               const NeighbourSearch& search, const LiquidArrivals& liquid) {
  const FilmRegion region = film.region();
  ctx.parallel_for("film/thick", region.vertices,
                   KeyThickFilm{law_, skin, region.vertex, film.heights_m(), film.volumes(), key_.view()});
  ctx.parallel_for("film/largest key", region.vertices,
                   LargestKey{skin.surface, region.vertex, key_.const_view(), most_.view()});
  ctx.parallel_for("film/givers", region.vertices,
                   FlagGivers{region.vertex, most_.const_view(), key_.view(), flag_.view()});
  ctx.compact("film/givers", region.vertices, flag_.const_view(), giver_.view(), givers_.view());
  const Count givers(givers_.const_view(), film.max_vertices());
  ctx.parallel_for("film/places", givers,
                   PlaceGiven{law_, skin, region.vertex, giver_.view(), place_m_.view()});
  places_.build(ctx, place_m_.const_view(), giver_.const_view(), givers);
  places_.visit(ctx, "film/room", search,
                FindLiquidRound{{1.F / law_.spacing_m},
                                law_.particle_m3,
                                places_.cells().particles,
                                View<const Vec3f>(liquid.x_m),
                                round_.view()});
  ctx.parallel_for("film/room", places_.placed(), FlagGiven{law_, round_.const_view(), flag_.view()});
  ctx.compact("film/given", places_.placed(), flag_.const_view(), list_.view(), flagged_.view());
}

void FilmExchange::run(ExecContext& ctx, Film& film, const FilmSkin& skin, const NeighbourSearch& search,
                       const LiquidArrivals& liquid) {
  ctx.parallel_for("film/choose", search.placed(),
                   ChooseTaken{law_, skin, film.volumes(), layers_.const_view(),
                               View<const Vec3f>(liquid.x_m), View<const Index>(liquid.id), target_.view()});
  ctx.parallel_for("film/take", search.placed(),
                   TakeParticles{law_, skin, target_.const_view(), layers_.view(), liquid.x_m, film.gains(),
                                 liquid.counters, ledger_.view()});
  ctx.parallel_for(
      "film/plan given", 1,
      PlanGiven{flagged_.const_view(), liquid, planned_.view(), slot_.view(), id_.view(), ledger_.view()});
  ctx.parallel_for("film/give", Count(planned_.const_view(), film.max_vertices()),
                   GiveParticles{law_, skin, list_.const_view(), places_.cells().order, giver_.const_view(),
                                 slot_.const_view(), id_.const_view(), place_m_.const_view(),
                                 film.gains().volume, liquid});
  if (!settings_.is_still && !settings_.is_new) start(ctx, skin.surface);
}

}  // namespace tactus
