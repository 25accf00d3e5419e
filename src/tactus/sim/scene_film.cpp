#include "tactus/sim/scene_film.h"

#include <algorithm>

#include "tactus/sim/body/body_cuts.h"
#include "tactus/tissue/embedded_surface.h"

namespace tactus {
namespace {

/// A particle touches a surface where a vertex is at most so far: d and an edge. Triangles may be larger than
/// the cubes that carry them: there, only their corners take particles.
float reach_m(const SoftBody& body, float spacing_m) {
  const TriangleMesh& surface = body.shape().surface_m;
  float longest_m = 0;
  for (const auto& t : surface.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      longest_m =
          std::max(longest_m, length(surface.positions_m[static_cast<std::size_t>(t.at(k))] -
                                     surface.positions_m[static_cast<std::size_t>(t.at((k + 1) % 3))]));
  return spacing_m + std::min(longest_m, body.shape().lattice.spacing_m);
}

/// In weightlessness, a puddle has no height at which it stops to grow.
float puddle_gravity_m_s2(Vec3d gravity_m_s2) {
  constexpr float kLeast_m_s2 = 0.01F;
  return std::max(static_cast<float>(length(gravity_m_s2)), kLeast_m_s2);
}

}  // namespace

bool has_film(const Scene& scene) {
  const auto any = [&](const auto& is) { return std::any_of(scene.bodies.begin(), scene.bodies.end(), is); };
  if (!scene.fluid || !any([](const BodyDescription& b) { return b.contact; })) return false;
  const LiquidDescription& f = *scene.fluid;
  return f.film.value_or(f.solver == LiquidModel::dfsph && f.surface_tension_n_m > 0 &&
                         any([](const BodyDescription& b) { return b.bleeding.has_value(); }));
}

SceneFilm::SceneFilm(ExecContext& ctx, const Scene& scene, Liquid& liquid)
    : ctx_(ctx),
      liquid_(liquid),
      gravity_m_s2_(puddle_gravity_m_s2(scene.gravity_m_s2)),
      drying_m_s_(static_cast<float>(scene.fluid->film_drying_m_s)) {}

FilmSurface SceneFilm::surface_of(const SoftBody& body) {
  const EmbeddedSurface& s = body.surface();
  return {s.vertices(),      s.all_triangles(),     s.position_buffer_m(),
          s.corner_buffer(), s.incident().ranges(), s.incident().values()};
}

void SceneFilm::add_body(SoftBody& body) {
  const LiquidSettings& liquid = liquid_.settings();
  const FilmSurface surface = surface_of(body);
  Coat& coat = coats_.emplace_back();
  coat.body = &body;
  coat.vertices = body.surface().vertex_count();
  coat.film = std::make_unique<Film>(ctx_,
                                     FilmSettings{.density_kg_m3 = liquid.density_kg_m3,
                                                  .viscosity_Pa_s = std::max(liquid.viscosity_Pa_s, 1e-6F),
                                                  .surface_tension_N_m = liquid.surface_tension_N_m,
                                                  .contact_angle_deg = liquid.contact_angle_deg,
                                                  .drying_m_s = drying_m_s_},
                                     surface.vertices.capacity, surface.triangles.capacity,
                                     body.surface().incident().capacity());
  coat.exchange =
      std::make_unique<FilmExchange>(ctx_,
                                     FilmExchangeSettings{.spacing_m = liquid.spacing_m,
                                                          .gravity_m_s2 = gravity_m_s2_,
                                                          .reach_m = reach_m(body, liquid.spacing_m),
                                                          .max_particles = liquid.max_particles},
                                     *coat.film);
  coat.exchange->add_vertices(ctx_, surface, 0, coat.vertices);
}

void SceneFilm::set_gravity(Vec3d gravity_m_s2) {
  gravity_m_s2_ = puddle_gravity_m_s2(gravity_m_s2);
  for (Coat& coat : coats_) coat.exchange->set_gravity_m_s2(gravity_m_s2_, *coat.film);
}

void SceneFilm::add_stages(Schedule& schedule, Readback& readback) {
  Stage stage{.name = "liquid/film",
              .timed_as = "film",
              .rate = Rate::before,
              .updates = {"liquid"},
              .submit = [this, &frame = schedule.frame()](BlockPlace) {
                for (Coat& coat : coats_) run(coat, frame.view(0));
              }};
  for (Coat& coat : coats_) {
    stage.reads_last.push_back(coat.body->resources().surface);
    coat.sums = readback.add(coat.film->sums());
    coat.ledger = readback.add(coat.exchange->ledger());
  }
  schedule.add(std::move(stage));
}

void SceneFilm::run(Coat& coat, View<const FrameParams> frame) {
  const FilmSurface surface = surface_of(*coat.body);
  coat.film->step(ctx_, surface, frame);
  coat.exchange->run(ctx_, *coat.film, surface, coat.body->surface().normal_buffer(), frame, liquid_.search(),
                     liquid_.arrivals());
  coat.film->sum(ctx_, surface.vertices);
}

SceneFilmReport SceneFilm::report(const Readback& readback) const {
  SceneFilmReport all;
  for (const Coat& coat : coats_) {
    const FilmSums sums = readback.get<FilmSums>(coat.sums)[0];
    const FilmLedger ledger = readback.get<FilmLedger>(coat.ledger)[0];
    all.film_m3 += static_cast<double>(sums.film) * double{kFilmUnit_m3};
    all.stain_m3 += static_cast<double>(sums.stain) * double{kFilmUnit_m3};
    all.wet_vertices += sums.wet;
    all.taken += ledger.taken;
    all.given += ledger.given;
  }
  return all;
}

void SceneFilm::follow_cut(const SoftBody& body) {
  const auto coat =
      std::find_if(coats_.begin(), coats_.end(), [&](const Coat& c) { return c.body == &body; });
  if (coat == coats_.end()) return;
  std::vector<Film::Move> moves;
  for (const auto& [from, to] : body.cuts()->heirs(coat->film->held(ctx_, coat->vertices)))
    moves.push_back({from, to});
  coat->film->move(ctx_, moves);
  const Index vertices = body.surface().vertex_count();
  coat->exchange->add_vertices(ctx_, surface_of(body), coat->vertices, vertices);
  coat->vertices = vertices;
  ctx_.synchronize();
}

void SceneFilm::archive(StateArchive& a) {
  for (Coat& coat : coats_) {
    a.set_owner("film on body '" + coat.body->name() + "'");
    coat.film->archive(ctx_, a);
    coat.exchange->archive(ctx_, a);
    if (a.reads()) coat.body->update_surface(ctx_);
  }
}

FilmThickness SceneFilm::thickness(const SoftBody& body, const TriangleMesh& surface) const {
  const auto coat =
      std::find_if(coats_.begin(), coats_.end(), [&](const Coat& c) { return c.body == &body; });
  if (coat == coats_.end()) return {};
  const auto n = surface.positions_m.size();
  std::vector<float> third_m2(n);
  for (const auto& t : surface.triangles) {
    const auto x = [&](int k) {
      return surface.positions_m[static_cast<std::size_t>(t.at(static_cast<std::size_t>(k)))];
    };
    const float area_m2 = length(cross(x(1) - x(0), x(2) - x(0))) / 6;
    for (const Index v : t) third_m2[static_cast<std::size_t>(v)] += area_m2;
  }
  const auto over_area = [&](const std::vector<std::int64_t>& units) {
    std::vector<float> all(n);
    for (std::size_t v = 0; v < n; ++v)
      if (third_m2[v] > 0) all[v] = kFilmUnit_m3 * static_cast<float>(units[v]) / third_m2[v];
    return all;
  };
  const auto count = static_cast<Index>(n);
  const Film& film = *coat->film;
  return {over_area(to_host(ctx_, film.volumes().part(0, count))),
          over_area(to_host(ctx_, film.stains().part(0, count)))};
}

}  // namespace tactus
