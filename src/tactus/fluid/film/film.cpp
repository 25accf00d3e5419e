#include "tactus/fluid/film/film.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "tactus/base/error.h"

namespace tactus {
namespace {

FilmLaw law_of(const FilmSettings& s) {
  const auto refuse = [](const char* what, float value, const char* expected) {
    throw Error(std::string("film: ") + what + " is " + std::to_string(value) + ", must be " + expected);
  };
  if (!(s.density_kg_m3 > 0)) refuse("density_kg_m3", s.density_kg_m3, "> 0");
  if (!(s.viscosity_Pa_s > 0)) refuse("viscosity_Pa_s", s.viscosity_Pa_s, "> 0");
  if (!(s.surface_tension_N_m >= 0)) refuse("surface_tension_N_m", s.surface_tension_N_m, ">= 0");
  if (!(s.contact_angle_deg >= 0 && s.contact_angle_deg <= 180))
    refuse("contact_angle_deg", s.contact_angle_deg, "from 0 to 180");
  if (!(s.resolved_m > 0)) refuse("resolved_m", s.resolved_m, "> 0");
  if (!(s.drying_m_s >= 0)) refuse("drying_m_s", s.drying_m_s, ">= 0");
  if (s.rings < 1) refuse("rings", static_cast<float>(s.rings), "> 0");
  if (s.most_passes < 1) refuse("most_passes", static_cast<float>(s.most_passes), "> 0");
  // An equilateral triangle of height l has the eigenvalue 4.5 / l^2.
  return {.density_kg_m3 = s.density_kg_m3,
          .mobility_1_Pa_s = 1.F / (3 * s.viscosity_Pa_s),
          .tension_N_m = s.surface_tension_N_m,
          .hold_N_m = s.surface_tension_N_m * (1 - std::cos(s.contact_angle_deg * kPi / 180)),
          .finest_1_m2 = 4.5F / (s.resolved_m * s.resolved_m)};
}

}  // namespace

Film::Film(ExecContext& ctx, const FilmSettings& settings, Index max_vertices, Index max_triangles,
           Index max_incident)
    : law_(law_of(settings)),
      rings_(settings.rings),
      drying_m_s_(settings.drying_m_s),
      volume_(ctx.device(), max_vertices),
      stain_(ctx.device(), max_vertices),
      area_(ctx.device(), max_vertices),
      gravity_(ctx.device(), max_vertices),
      eigen_(ctx.device(), max_vertices),
      height_(ctx.device(), max_vertices),
      pressure_(ctx.device(), max_vertices),
      triangles_(ctx.device(), max_triangles),
      place_(ctx.device(), max_triangles),
      fields_(ctx.device(), FilmFlowFields::kFields * std::int64_t{max_triangles}),
      corners_(ctx.device(), 3 * std::int64_t{max_triangles}),
      spokes_(ctx.device(), max_incident),
      flow_(ctx.device(), 3 * std::int64_t{max_triangles}),
      change_(ctx.device(), max_vertices),
      mark_(ctx.device(), max_vertices),
      near_(ctx.device(), max_vertices),
      region_vertex_(ctx.device(), max_vertices),
      region_triangle_(ctx.device(), max_triangles),
      counts_(ctx.device(), FilmCounts::size(settings.rings)),
      rate_(ctx.device(), ceil_div(max_triangles, FindFilmRates::kThreads)),
      passes_(ctx.device(), 1),
      sums_(ctx.device(), 1),
      dried_(ctx.device(), 1),
      vertex_count_(ctx.device(), settings.most_passes),
      triangle_count_(ctx.device(), settings.most_passes) {
  ctx.fill_bytes(volume_.view(), 0);
  ctx.fill_bytes(stain_.view(), 0);
  ctx.fill_bytes(height_.view(), 0);
  ctx.fill_bytes(flow_.view(), 0);
  ctx.fill_bytes(change_.view(), 0);
  ctx.fill_bytes(mark_.view(), 0);
  ctx.fill_bytes(counts_.view(), 0);
  ctx.fill_bytes(dried_.view(), 0);
  ctx.fill_bytes(passes_.view(), 0);
  ctx.fill_bytes(sums_.view(), 0);
}

void Film::find_region(ExecContext& ctx, const FilmSurface& surface) {
  const Index n = surface.vertices.capacity;
  const FilmCounts counts{counts_.view()};
  ctx.parallel_for("film/wet", ceil_div(n, KeepWetFilm::kThreads),
                   KeepWetFilm{gains(), change_.view(), height_.view(), region_vertex_.view()});
  for (Index ring = 0; ring < rings_; ++ring)
    ctx.parallel_for("film/ring", Count(counted(FilmCounts::kFirstRing + ring), n),
                     MarkFilmRing{surface, mark_.view(), counts, region_vertex_.view(), ring});
  ctx.parallel_for("film/count", 1, CountFilmRegion{counts});
  ctx.parallel_for("film/list", ceil_div(n, ListFilmTriangles::kThreads),
                   ListFilmTriangles{surface, mark_.const_view(), counts, region_vertex_.const_view(),
                                     near_.view(), region_triangle_.view()});
}

void Film::step(ExecContext& ctx, const FilmSurface& surface, View<const FrameParams> frame) {
  find_region(ctx, surface);
  const FilmRegion region = this->region();
  ctx.parallel_for("film/triangles", region.triangles,
                   MeasureFilmTriangles{law_, surface, region.triangle, frame, mark_.const_view(),
                                        triangles_.view(), place_.view()});
  ctx.parallel_for("film/vertices", region.vertices,
                   MeasureFilmVertices{surface, region.vertex, triangles_.const_view(), place_.const_view(),
                                       volume_.const_view(), area_.view(), gravity_.view(), eigen_.view(),
                                       height_.view(), spokes_.view()});
  const FilmFlowFields fields{fields_.view(), corners_.view()};
  ctx.parallel_for(
      "film/rates", ceil_div(surface.triangles.capacity, FindFilmRates::kThreads),
      FindFilmRates{law_, surface, region, eigen_.const_view(), height_.const_view(), volume_.const_view(),
                    change_.const_view(), triangles_.const_view(), fields, rate_.view()});
  ctx.parallel_for("film/plan", 1,
                   PlanFilmPasses{region, frame, rate_.const_view(), passes_.view(), vertex_count_.view(),
                                  triangle_count_.view()});
  for (Index k = 0; k < vertex_count_.size(); ++k) {
    const Count vertices(vertex_count_.const_view().part(k, 1), surface.vertices.capacity);
    const Count triangles(triangle_count_.const_view().part(k, 1), surface.triangles.capacity);
    ctx.parallel_for("film/press", vertices,
                     PressFilm{law_, region.vertex, surface.lists, spokes_.const_view(), area_.const_view(),
                               gravity_.const_view(), height_.const_view(), pressure_.view()});
    ctx.parallel_for("film/flow", triangles,
                     FlowFilm{law_, fields, passes_.const_view(), height_.const_view(),
                              pressure_.const_view(), flow_.view()});
    ctx.parallel_for("film/gather", vertices,
                     GatherFilm{region.vertex, surface.lists, spokes_.const_view(), flow_.const_view(),
                                area_.const_view(), volume_.view(), change_.view(), height_.view()});
  }
  if (drying_m_s_ > 0)
    ctx.parallel_for("film/dry", ceil_div(surface.vertices.capacity, DryFilm::kThreads),
                     DryFilm{drying_m_s_, frame, region, area_.const_view(), volume_.view(), stain_.view(),
                             height_.view(), dried_.view()});
}

void Film::sum(ExecContext& ctx) {
  const Count near(counted(FilmCounts::kNear), near_.size());
  ctx.fill_bytes(sums_.view(), 0);
  ctx.parallel_for(
      "film/sum", ceil_div(near.capacity, SumFilm::kThreads),
      SumFilm{near, near_.const_view(), volume_.const_view(), dried_.const_view(), sums_.view()});
}

/// Where volumes came otherwise than by gains().
void Film::note_wet(ExecContext& ctx) {
  ctx.fill_bytes(counts_.view(), 0);
  ctx.parallel_for("film/note", max_vertices(), NoteWetFilm{gains(), change_.view(), height_.view()});
  ctx.synchronize();
}

void Film::set_volumes(ExecContext& ctx, std::span<const std::int64_t> volumes) {
  ctx.upload(volumes, volume_.view());
  note_wet(ctx);
}

std::vector<std::uint8_t> Film::held(ExecContext& ctx, Index vertices) const {
  const std::vector<std::int64_t> volume = to_host(ctx, volume_.const_view().part(0, vertices)),
                                  stain = to_host(ctx, stain_.const_view().part(0, vertices));
  std::vector<std::uint8_t> all(volume.size());
  for (std::size_t v = 0; v < all.size(); ++v) all[v] = volume[v] > 0 || stain[v] > 0 ? 1 : 0;
  return all;
}

void Film::move(ExecContext& ctx, std::span<const Move> moves) {
  if (moves.empty()) return;
  for (Buffer<std::int64_t>* units : {&volume_, &stain_}) {
    std::vector<std::int64_t> host = to_host(ctx, units->const_view());
    for (const Move& m : moves)
      host[static_cast<std::size_t>(m.to)] += std::exchange(host[static_cast<std::size_t>(m.from)], 0);
    ctx.upload(host, units->view());
    ctx.synchronize();
  }
  note_wet(ctx);
}

void Film::archive(ExecContext& ctx, StateArchive& a, std::int64_t stain_elsewhere) {
  std::vector<std::int64_t> volume = to_host(ctx, volume_.const_view()),
                            stain = to_host(ctx, stain_.const_view());
  a.values("volumes of film", volume);
  a.values("volumes of stains", stain);
  a.buffer(ctx, "changes of film", change_);
  constexpr std::int64_t kMost = std::int64_t{1} << 56;  // 1 m^3
  const auto is_volume = [](std::int64_t units) { return units >= 0 && units <= kMost; };
  a.check(std::all_of(volume.begin(), volume.end(), is_volume), "volumes of film");
  a.check(std::all_of(stain.begin(), stain.end(), is_volume), "volumes of stains");
  if (!a.reads()) return;
  const std::vector<std::uint64_t> dried{
      static_cast<std::uint64_t>(std::accumulate(stain.begin(), stain.end(), stain_elsewhere))};
  ctx.upload(stain, stain_.view());
  ctx.upload(dried, dried_.view());
  set_volumes(ctx, volume);
}

}  // namespace tactus
