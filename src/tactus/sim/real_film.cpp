#include "tactus/sim/real_film.h"

#include <algorithm>
#include <utility>

#include "tactus/fluid/film/film_kernels.h"
#include "tactus/sim/film_obstacles.h"
#include "tactus/sim/real_film_kernels.h"

namespace tactus {
namespace {

Index most_vertices(const MeshView& mesh) {
  return std::min(mesh.positions_m.size(), RealFilm::kMostVertices);
}
Index most_triangles(const MeshView& mesh) {
  return std::min(mesh.triangles.size(), 2 * RealFilm::kMostVertices);
}

FilmExchangeSettings reaching(FilmExchangeSettings exchange, float cell_m) {
  exchange.reach_m = exchange.spacing_m + RealFilm::kLongestEdge * cell_m;
  exchange.is_new = true;
  return exchange;
}

}  // namespace

RealFilm::RealFilm(ExecContext& ctx, const FilmSettings& film, FilmExchangeSettings exchange, float cell_m,
                   const RealSurface& real, std::function<MeshView()> mesh)
    : ctx_(ctx),
      real_(real),
      mesh_(std::move(mesh)),
      near_m_(reaching(exchange, cell_m).reach_m),
      film_(ctx, film, most_vertices(mesh_()), most_triangles(mesh_()), 3 * most_triangles(mesh_())),
      exchange_(ctx, reaching(exchange, cell_m), film_),
      carry_(ctx, {.max_vertices = most_vertices(mesh_()),
                   .max_triangles = most_triangles(mesh_()),
                   .reach_m = kCarryReach * cell_m}),
      touching_(ctx.device()),
      wanted_(ctx.device(), 1),
      counts_(ctx.device(), 2),
      x_m_(ctx.device(), most_vertices(mesh_())),
      normal_(ctx.device(), most_vertices(mesh_())) {
  ctx.fill_bytes(wanted_.view(), 0);
  ctx.fill_bytes(counts_.view(), 0);
}

void RealFilm::carry() {
  const VertexMotions of = real_.vertex_motions();
  carry_.lift(ctx_, film_);
  ctx_.parallel_for("film/move real", carry_.points(), MoveRealFilm{of, carry_.point(), carry_.places_m()});
  carry_.land(ctx_, film_, mesh_());
  ctx_.parallel_for("film/tag real", carry_.new_vertices(), TagRealFilm{of, carry_.tags()});
}

void RealFilm::link() {
  carry_.link(ctx_, mesh_(), wanted_.const_view());
  ctx_.parallel_for("film/tag real", carry_.new_vertices(),
                    TagRealFilm{real_.vertex_motions(), carry_.tags()});
}

/// As it moves in this frame.
FilmSurface RealFilm::surface() const {
  FilmSurface surface = carry_.surface(mesh_(), x_m_.const_view());
  surface.vertices = {counts_.const_view().part(0, 1), x_m_.size()};
  surface.triangles = {counts_.const_view().part(1, 1), surface.triangles.capacity};
  return surface;
}

void RealFilm::flow(View<const FrameParams> frame, Liquid& liquid) {
  const VertexMotions of = real_.vertex_motions();
  ctx_.parallel_for("film/find real", 1, FindRealFilm{film_.sums(), carry_.waiting(), wanted_.view()});
  ctx_.parallel_for(
      "film/near real", liquid.search().placed(),
      FindNearRealFilm{View<const Vec3f>(liquid.arrivals().x_m), of, frame, near_m_, wanted_.view()});
  link();
  ctx_.parallel_for(
      "film/count real", 1,
      CountRealFilm{wanted_.const_view(), carry_.vertices(), carry_.triangles(), counts_.view()});
  const FilmSurface surface = this->surface();
  ctx_.parallel_for("film/pose real", surface.vertices,
                    PoseRealFilm{of, frame, std::as_const(carry_).tags(), carry_.x_m(), carry_.normals(),
                                 x_m_.view(), normal_.view(), exchange_.last_places_m()});
  const FilmSkin skin = exchange_.skin(surface, normal_.const_view(), frame);
  exchange_.find_touching(touching_.follow(ctx_), skin, liquid.search(), liquid.arrivals());
  film_.step(ctx_, surface, frame);
  exchange_.find_givers(ctx_, film_, skin, liquid.search(), liquid.arrivals());
  touching_.join(ctx_);
}

void RealFilm::exchange(View<const FrameParams> frame, Liquid& liquid) {
  exchange_.run(ctx_, film_, exchange_.skin(surface(), normal_.const_view(), frame), liquid.search(),
                liquid.arrivals());
  film_.sum(ctx_);
}

void RealFilm::add_readback(Readback& readback) {
  sums_ = readback.add(film_.sums());
  ledger_ = readback.add(exchange_.ledger());
  waiting_ = readback.add(carry_.waiting());
}

void RealFilm::add_report(const Readback& readback, SceneFilmReport& all) const {
  const FilmSums sums = readback.get<FilmSums>(sums_)[0];
  const FilmLedger ledger = readback.get<FilmLedger>(ledger_)[0];
  const FilmWaiting waiting = readback.get<FilmWaiting>(waiting_)[0];
  all.film_m3 += static_cast<double>(sums.film + waiting.film) * double{kFilmUnit_m3};
  all.stain_m3 += static_cast<double>(sums.stain) * double{kFilmUnit_m3};  // that which waits is in it
  all.wet_vertices += sums.wet;
  all.taken += ledger.taken;
  all.given += ledger.given;
}

void RealFilm::archive(StateArchive& a) {
  a.set_owner("film on the real surface");
  const std::int64_t stain = carry_.archive(ctx_, a, [this] {
    const std::vector<Index> one{1};
    ctx_.upload(one, wanted_.view());
    ctx_.synchronize();
    link();
    ctx_.synchronize();
  });
  film_.archive(ctx_, a, stain);
  exchange_.archive(ctx_, a);
  if (!a.reads()) return;
  film_.sum(ctx_);
  ctx_.synchronize();
}

WetObstacle RealFilm::wet() const {
  const std::vector<FilmSums> sums = to_host(ctx_, film_.sums());
  if (sums[0].film == 0 && sums[0].stain == 0) return {};
  const MeshView mesh = mesh_();
  FilmObstacles::Part part;
  part.name = kRealSurfaceName;
  const auto count = [&](const Count& of) { return to_host(ctx_, View<const Index>(of.device_count, 1))[0]; };
  const Index n = count(carry_.vertices()), m = count(carry_.triangles());
  part.mesh.positions_m = to_host(ctx_, carry_.x_m().part(0, n));
  part.mesh.normals = to_host(ctx_, carry_.normals().part(0, n));
  for (const Vec3i& t : to_host(ctx_, mesh.triangles.part(0, m))) part.triangles.push_back({t.x, t.y, t.z});
  for (Index v = 0; v < n; ++v) part.vertices.push_back(v);
  return part.where_wet(to_host(ctx_, film_.volumes().part(0, n)), to_host(ctx_, film_.stains().part(0, n)));
}

}  // namespace tactus
