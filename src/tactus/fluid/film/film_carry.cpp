#include "tactus/fluid/film/film_carry.h"

#include <string>

#include "tactus/base/error.h"
#include "tactus/fluid/film/film_carry_kernels.h"

namespace tactus {
namespace {

FilmCarrySettings checked(const FilmCarrySettings& s) {
  const auto require = [](bool ok, const char* what, double value) {
    if (!ok)
      throw Error(std::string("film that is carried: ") + what + " is " + std::to_string(value) +
                  ", must be > 0");
  };
  require(s.max_vertices > 0, "max_vertices", s.max_vertices);
  require(s.max_triangles > 0, "max_triangles", s.max_triangles);
  require(s.reach_m > 0, "reach_m", static_cast<double>(s.reach_m));
  require(s.max_waiting > 0, "max_waiting", s.max_waiting);
  return s;
}

}  // namespace

FilmCarry::FilmCarry(ExecContext& ctx, const FilmCarrySettings& settings)
    : max_triangles_(checked(settings).max_triangles),
      counts_(ctx.device(), FilmCarryCounts::kSize),
      sums_(ctx.device(), 1),
      x_m_(ctx.device(), settings.max_vertices),
      normal_(ctx.device(), settings.max_vertices),
      offset_m_(ctx.device(), settings.max_vertices),
      tag_(ctx.device(), settings.max_vertices),
      degree_(ctx.device(), settings.max_vertices),
      first_(ctx.device(), settings.max_vertices),
      incident_(ctx.device(), 3 * std::int64_t{settings.max_triangles}),
      lists_(ctx.device(), settings.max_vertices),
      moment_(ctx.device(), 4 * std::int64_t{settings.max_vertices}),
      flag_(ctx.device(), std::int64_t{settings.max_vertices} + settings.max_waiting),
      list_(ctx.device(), flag_.size()),
      points_(ctx.device(), flag_.size()),
      waiting_(ctx.device(), settings.max_waiting),
      place_m_(ctx.device(), flag_.size()),
      waiting_m_(ctx.device(), settings.max_waiting),
      from_(ctx.device(), {.max_particles = flag_.size(), .reach_m = settings.reach_m}),
      to_(ctx.device(), {.max_particles = settings.max_vertices, .reach_m = settings.reach_m}) {
  ctx.fill_bytes(counts_.view(), 0);
  ctx.fill_bytes(sums_.view(), 0);
  ctx.fill_bytes(waiting_.view(), 0);
  ctx.fill_bytes(waiting_m_.view(), 0);
  ctx.fill_bytes(offset_m_.view(), 0);
}

void FilmCarry::lift(ExecContext& ctx, Film& film) {
  const FilmCarryCounts counts{counts_.view()};
  const FilmStore store = film.store();
  ctx.parallel_for("film/flag", vertices(), FlagFilm{store, flag_.view()});
  ctx.compact("film/flag", vertices(), flag_.const_view(), list_.view(), one(FilmCarryCounts::kHeld));
  ctx.parallel_for("film/lift", count(FilmCarryCounts::kHeld, x_m_.size()),
                   LiftFilm{store, list_.const_view(), x_m_.const_view(), offset_m_.const_view(),
                            normal_.const_view(), tag_.const_view(), points_.view(), place_m_.view()});
  ctx.parallel_for(
      "film/retry", count(FilmCarryCounts::kWaiting, waiting_.size()),
      RetryFilm{counts, waiting_.const_view(), waiting_m_.const_view(), points_.view(), place_m_.view()});
  ctx.parallel_for("film/forget",
                   Count(store.gains.counts.all.part(FilmCounts::kNear, 1), film.max_vertices()),
                   ForgetFilm{store});
  ctx.parallel_for("film/lifted", 1, EndLifting{counts, store, sums_.view()});
}

void FilmCarry::link(ExecContext& ctx, const MeshView& mesh, View<const Index> wanted) {
  ctx.parallel_for("film/plan links", 1,
                   PlanFilmLink{mesh, wanted, {counts_.view()}, x_m_.size(), max_triangles_});
  const Count vertices = new_vertices(), triangles = count(FilmCarryCounts::kLinkTriangles, max_triangles_);
  const LinkedTriangles of{mesh};
  ctx.parallel_for("film/begin links", vertices,
                   BeginFilmLinks{mesh, x_m_.view(), offset_m_.view(), degree_.view(), moment_.view()});
  ctx.parallel_for("film/count corners", triangles, CountFilmCorners{of, degree_.view()});
  ctx.exclusive_scan("film/lists", vertices, degree_.const_view(), first_.view());
  ctx.parallel_for("film/open lists", vertices, OpenFilmLists{first_.const_view(), lists_.view()});
  ctx.parallel_for("film/fill lists", triangles, FillFilmLists{of, lists_.view(), incident_.view()});
  ctx.parallel_for("film/sort lists", vertices,
                   SortFilmLists{mesh, lists_.const_view(), incident_.view(), normal_.view()});
}

void FilmCarry::land(ExecContext& ctx, Film& film, const MeshView& mesh) {
  const FilmCarryCounts counts{counts_.view()};
  const FilmStore store = film.store();
  link(ctx, mesh, one(FilmCarryCounts::kPoints));
  to_.build(ctx, x_m_.const_view(), {}, vertices());
  from_.build(ctx, place_m_.const_view(), {}, points());
  from_.visit(ctx, "film/landing", to_,
              FindLanding{from_.cells().order, to_.cells().order, place_m_.const_view(), x_m_.const_view(),
                          normal_.const_view(), points_.view()});
  ctx.parallel_for("film/land", points(),
                   LandFilm{surface(mesh, x_m_.const_view()), store, place_m_.const_view(), points_.view(),
                            moment_.view(), flag_.view()});
  ctx.parallel_for("film/settle",
                   Count(store.gains.counts.all.part(FilmCounts::kNear, 1), film.max_vertices()),
                   SettleFilm{store.gains.near, moment_.const_view(), offset_m_.view()});
  ctx.compact("film/waiting", points(), flag_.const_view(), list_.view(), one(FilmCarryCounts::kWaiting));
  ctx.parallel_for("film/waiting", count(FilmCarryCounts::kWaiting, list_.size()),
                   KeepWaitingFilm{list_.const_view(), points_.const_view(), place_m_.const_view(),
                                   waiting_.view(), waiting_m_.view(), sums_.view()});
  ctx.parallel_for("film/landed", 1,
                   EndWaitingFilm{counts, list_.const_view(), points_.const_view(), waiting_.view()});
}

std::int64_t FilmCarry::archive(ExecContext& ctx, StateArchive& a, const std::function<void()>& link) {
  std::vector<Index> counts = to_host(ctx, counts_.const_view());
  Index is_linked = counts[FilmCarryCounts::kVertices] > 0 ? 1 : 0;
  a.value("whether a mesh is linked", is_linked);
  if (a.reads()) {
    ctx.fill_bytes(counts_.view(), 0);
    if (is_linked != 0) link();
    counts = to_host(ctx, counts_.const_view());
  }
  Index& waiting = counts[FilmCarryCounts::kWaiting];
  a.value("places where film waits", waiting);
  a.check(waiting >= 0 && waiting <= waiting_.size(), "places where film waits");
  a.buffer(ctx, "film that waits", waiting_);
  a.buffer(ctx, "where film waits", waiting_m_);
  a.buffer(ctx, "centroids of film", offset_m_);
  constexpr std::int64_t kMost = std::int64_t{1} << 56;  // 1 m^3
  FilmWaiting sums;
  const std::vector<FilmPoint> points = to_host(ctx, waiting_.const_view());
  for (Index k = 0; k < waiting; ++k) {
    const FilmPoint& p = points[static_cast<std::size_t>(k)];
    a.check(p.units >= 0 && p.units <= kMost && p.stain >= 0 && p.stain <= kMost, "film that waits");
    sums.film += static_cast<std::uint64_t>(p.units);
    sums.stain += static_cast<std::uint64_t>(p.stain);
  }
  if (a.reads()) {
    ctx.upload(counts, counts_.view());
    const std::vector<FilmWaiting> one{sums};
    ctx.upload(one, sums_.view());
    ctx.synchronize();
  }
  return static_cast<std::int64_t>(sums.stain);
}

}  // namespace tactus
