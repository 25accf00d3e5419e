#include "tactus/sim/scene_film.h"

#include <algorithm>
#include <utility>

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
  const bool is_touched = any([](const BodyDescription& b) { return b.contact; });
  if (!scene.fluid) return false;
  const LiquidDescription& f = *scene.fluid;
  if (f.film) return *f.film && (is_touched || !scene.obstacles.empty() || f.open != LiquidOpen::all);
  return is_touched && f.solver == LiquidModel::dfsph && f.surface_tension_n_m > 0 &&
         any([](const BodyDescription& b) { return b.bleeding.has_value(); });
}

SceneFilm::SceneFilm(ExecContext& ctx, const Scene& scene, Liquid& liquid)
    : ctx_(ctx),
      liquid_(liquid),
      gravity_m_s2_(puddle_gravity_m_s2(scene.gravity_m_s2)),
      drying_m_s_(static_cast<float>(scene.fluid->film_drying_m_s)) {}

FilmSurface SceneFilm::surface_of(const SoftBody* body) const {
  if (body == nullptr) return obstacles_->surface();
  const EmbeddedSurface& s = body->surface();
  return {s.vertices(),      s.all_triangles(),     s.position_buffer_m(),
          s.corner_buffer(), s.incident().ranges(), s.incident().values()};
}

FilmSettings SceneFilm::film_settings() const {
  const LiquidSettings& liquid = liquid_.settings();
  return {.density_kg_m3 = liquid.density_kg_m3,
          .viscosity_Pa_s = std::max(liquid.viscosity_Pa_s, 1e-6F),
          .surface_tension_N_m = liquid.surface_tension_N_m,
          .contact_angle_deg = liquid.contact_angle_deg,
          .drying_m_s = drying_m_s_};
}

FilmExchangeSettings SceneFilm::exchange_settings() const {
  const LiquidSettings& liquid = liquid_.settings();
  return {
      .spacing_m = liquid.spacing_m, .gravity_m_s2 = gravity_m_s2_, .max_particles = liquid.max_particles};
}

SceneFilm::Coat& SceneFilm::add_coat(const FilmSurface& surface, Index most_incident, float reach_m,
                                     Index vertices, bool is_still) {
  Coat& coat = coats_.emplace_back();
  coat.vertices = vertices;
  coat.film = std::make_unique<Film>(ctx_, film_settings(), surface.vertices.capacity,
                                     surface.triangles.capacity, most_incident);
  FilmExchangeSettings exchange = exchange_settings();
  exchange.reach_m = reach_m;
  exchange.is_still = is_still;
  coat.exchange = std::make_unique<FilmExchange>(ctx_, exchange, *coat.film);
  coat.touching = std::make_unique<SideStream>(ctx_.device());
  coat.flowing = std::make_unique<SideStream>(ctx_.device());
  coat.flowing->reserve_scratch(coat.film->max_vertices());
  if (is_still)
    coat.exchange->start(ctx_, surface);
  else
    coat.exchange->add_vertices(ctx_, surface, 0, vertices);
  return coat;
}

void SceneFilm::add_body(SoftBody& body) {
  const EmbeddedSurface& s = body.surface();
  add_coat(surface_of(&body), s.incident().capacity(), reach_m(body, liquid_.settings().spacing_m),
           s.vertex_count(), false)
      .body = &body;
}

void SceneFilm::renew(SoftBody& body) {
  const auto known =
      std::find_if(coats_.begin(), coats_.end(), [&](const Coat& c) { return c.body == &body; });
  if (known == coats_.end()) return;
  const auto place = static_cast<std::size_t>(known - coats_.begin());
  add_body(body);
  coats_[place] = std::move(coats_.back());
  coats_.pop_back();
}

void SceneFilm::add_obstacles(std::span<const ObstacleDescription> obstacles, std::vector<Notice>& notices) {
  constexpr Index kFloor = 1 << 2;  // of open_faces
  const LiquidSettings& liquid = liquid_.settings();
  const bool has_floor = (liquid.open_faces & kFloor) == 0;
  obstacles_ =
      std::make_unique<FilmObstacles>(ctx_, obstacles, liquid.box_m, has_floor, liquid.spacing_m, notices);
  if (obstacles_->empty()) return;
  add_coat(obstacles_->surface(), obstacles_->surface().incident.size(),
           liquid.spacing_m + obstacles_->edge_m(), obstacles_->vertex_count(), !obstacles_->move());
}

void SceneFilm::add_real(const RealSurface& real, std::function<MeshView()> mesh, float cell_m) {
  real_ =
      std::make_unique<RealFilm>(ctx_, film_settings(), exchange_settings(), cell_m, real, std::move(mesh));
}

void SceneFilm::place_obstacles(std::span<const Rigidd> T_world) {
  if (obstacles_) obstacles_->place(ctx_, T_world);
}

void SceneFilm::set_gravity(Vec3d gravity_m_s2) {
  gravity_m_s2_ = puddle_gravity_m_s2(gravity_m_s2);
  for (Coat& coat : coats_) coat.exchange->set_gravity_m_s2(gravity_m_s2_, *coat.film);
  if (real_) real_->set_gravity_m_s2(gravity_m_s2_);
}

void SceneFilm::add_stages(Schedule& schedule, Readback& readback) {
  Stage stage{.name = "liquid/film",
              .timed_as = "film",
              .rate = Rate::before,
              .updates = {"liquid"},
              .submit = [this, &frame = schedule.frame()](BlockPlace) { run(frame.view(0)); }};
  for (Coat& coat : coats_) {
    if (coat.body != nullptr) stage.reads_last.push_back(coat.body->resources().surface);
    coat.sums = readback.add(coat.film->sums());
    coat.ledger = readback.add(coat.exchange->ledger());
  }
  schedule.add(std::move(stage));
  if (!real_) return;
  real_->add_readback(readback);
  schedule.add({.name = "liquid/carry film",
                .timed_as = "film",
                .rate = Rate::capture,
                .updates = {"liquid"},
                .reads = {"surface/samples"},
                .submit = [this](BlockPlace) { real_->carry(); }});
}

/// Films flow side by side, as each is some eighty small kernels, and find what they exchange with particles.
/// Then they exchange one by one.
void SceneFilm::run(View<const FrameParams> frame) {
  const NeighbourSearch& search = liquid_.search();
  const LiquidArrivals liquid = liquid_.arrivals();
  for (Coat& coat : coats_) {
    ExecContext &touching = coat.touching->follow(ctx_), &flowing = coat.flowing->follow(ctx_);
    coat.exchange->find_touching(touching, skin(coat, frame), search, liquid);
    coat.film->step(flowing, surface_of(coat.body), frame);
    coat.exchange->find_givers(flowing, *coat.film, skin(coat, frame), search, liquid);
  }
  if (real_) real_->flow(frame, liquid_);
  for (Coat& coat : coats_) {
    coat.touching->join(ctx_);
    coat.flowing->join(ctx_);
  }
  for (Coat& coat : coats_) {
    coat.exchange->run(ctx_, *coat.film, skin(coat, frame), search, liquid);
    coat.film->sum(ctx_);
  }
  if (real_) real_->exchange(frame, liquid_);
}

FilmSkin SceneFilm::skin(const Coat& coat, View<const FrameParams> frame) const {
  const View<const Vec3f> normals =
      coat.body != nullptr ? coat.body->surface().normal_buffer() : obstacles_->normals();
  return coat.exchange->skin(surface_of(coat.body), normals, frame);
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
  if (real_) real_->add_report(readback, all);
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
  coat->exchange->add_vertices(ctx_, surface_of(&body), coat->vertices, vertices);
  coat->vertices = vertices;
  ctx_.synchronize();
}

void SceneFilm::archive(StateArchive& a) {
  for (Coat& coat : coats_) {
    a.set_owner(coat.body != nullptr ? "film on body '" + coat.body->name() + "'" : "film on obstacles");
    coat.film->archive(ctx_, a);
    coat.exchange->archive(ctx_, a);
    if (a.reads() && coat.body != nullptr) coat.body->update_surface(ctx_);
  }
  if (real_) real_->archive(a);
}

FilmThickness SceneFilm::thickness(const SoftBody& body, const TriangleMesh& surface) const {
  const auto coat =
      std::find_if(coats_.begin(), coats_.end(), [&](const Coat& c) { return c.body == &body; });
  if (coat == coats_.end()) return {};
  const auto count = static_cast<Index>(surface.positions_m.size());
  const Film& film = *coat->film;
  return film_thickness(surface.positions_m, surface.triangles, to_host(ctx_, film.volumes().part(0, count)),
                        to_host(ctx_, film.stains().part(0, count)));
}

std::vector<WetObstacle> SceneFilm::wet_obstacles(std::span<const Rigidd> T_world) const {
  std::vector<WetObstacle> all;
  if (obstacles_ && !obstacles_->empty()) add_wet_obstacles(T_world, all);
  if (!real_) return all;
  if (WetObstacle wet = real_->wet(); !wet.mesh.triangles.empty()) all.push_back(std::move(wet));
  return all;
}

void SceneFilm::add_wet_obstacles(std::span<const Rigidd> T_world, std::vector<WetObstacle>& all) const {
  const Film& film = *coats_.back().film;
  for (const FilmObstacles::Part& part : obstacles_->parts()) {
    const auto of_part = [&](const View<const std::int64_t>& units) {
      return to_host(ctx_, units.part(part.first, static_cast<Index>(part.vertices.size())));
    };
    WetObstacle wet = part.where_wet(of_part(film.volumes()), of_part(film.stains()));
    if (wet.mesh.triangles.empty()) continue;
    if (part.moving >= 0) {
      const Rigidd& T = T_world[static_cast<std::size_t>(part.moving)];
      for (Vec3f& p : wet.mesh.positions_m) p = vec_cast<float>(T * vec_cast<double>(p));
      for (Vec3f& n : wet.mesh.normals) n = vec_cast<float>(T.R * vec_cast<double>(n));
    }
    all.push_back(std::move(wet));
  }
}

}  // namespace tactus
