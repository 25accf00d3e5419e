#include "tactus/contact/real/real_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace tactus {
namespace {

// A triangle's middle is at most 2/3 of its longest edge from any of its points: 0.83 spacings.
constexpr float kCutEdge = 1.25F;
constexpr float kFineCell = 2, kCoarseCell = 8;  // edges of search cells, in spacings

RealSurfaceSettings checked(const RealSurfaceSettings& s) {
  const auto positive = [](const char* name, double value) {
    if (!(value > 0 && value < 2e9))
      throw Error(std::string("real surface: ") + name + " is " + std::to_string(value) + ", must be > 0");
  };
  positive("sample_spacing_m", static_cast<double>(s.sample_spacing_m));
  positive("max_vertices", s.max_vertices);
  positive("max_triangles", s.max_triangles);
  positive("max_raw_samples", s.max_raw_samples);
  positive("max_samples", s.max_samples);
  positive("max_speed_m_s", static_cast<double>(s.max_speed_m_s));
  return s;
}

/// Into how many components an edge is cut at most: their squares, over all triangles, still fit an Index.
/// Meshes above 2^21 triangles come from lattices finer than the samples, and few of their edges are cut at
/// all.
float most_cuts(Index max_triangles) {
  const double components = static_cast<double>(std::numeric_limits<Index>::max()) / max_triangles;
  return std::min(std::floor(static_cast<float>(std::sqrt(components))), static_cast<float>(kMaxCuts - 1));
}

void check_fits(const char* what, Index have, Index capacity) {
  if (have > capacity) {
    throw Error("real surface: the mesh has capacity for " + std::to_string(have) + " " + what + ", max_" +
                what + " is " + std::to_string(capacity));
  }
}

}  // namespace

RealSurface::RealSurface(Device& device, const RealSurfaceSettings& settings)
    : settings_(checked(settings)),
      spacing_m_(settings.sample_spacing_m),
      cuts_(device, settings.max_triangles),
      first_(device, settings.max_triangles),
      raw_count_(device, 1),
      raw_overflow_(device, 1),
      x_m_(device, settings.max_raw_samples),
      n_(device, settings.max_raw_samples),
      area_m2_(device, settings.max_raw_samples),
      root_(device, settings.max_raw_samples),
      triangle_(device, settings.max_raw_samples),
      component_number_(device, settings.max_vertices),
      triangle_component_(device, settings.max_raw_samples),
      triangle_face_(device, settings.max_raw_samples),
      balls_(device, settings.max_raw_samples),
      corners_(device, settings.max_raw_samples),
      parent_(device, settings.max_vertices),
      component_samples_(device, settings.max_vertices),
      candidates_(device, settings.max_samples / kLeastComponentSamples + 1),
      candidate_count_(device, 1),
      fine_(device, settings.max_raw_samples, settings.max_samples, kFineCell * settings.sample_spacing_m, 2),
      coarse_(device, settings.max_samples, max(settings.max_samples / 4, Index(64)),
              kCoarseCell * settings.sample_spacing_m, 2),
      dt_capture_s_(device, 1),
      previous_m_(device, kFitPoints),
      fit_(device, kComponents),
      fit_points_(device, FirstFitStep::kEvaluations * kFitPoints),
      component_parts_(device, kComponents * kComponentParts),
      components_(device, 1),
      last_components_(device, 1),
      motions_(device, kComponents),
      measured_(device, kComponents),
      report_(device, 1) {}

void RealSurface::set_coarseness(float spacings) {
  ++version_;
  spacing_m_ = spacings * settings_.sample_spacing_m;
  fine_.set_cell_m(kFineCell * spacing_m_);
  coarse_.set_cell_m(kCoarseCell * spacing_m_);
}

void RealSurface::update(ExecContext& ctx, const MeshView& mesh, float dt_capture_s) {
  ctx.parallel_for("contact/set_dt", 1, SetCaptureTime{dt_capture_s_.view(), dt_capture_s});
  update(ctx, mesh, dt_capture_s_.const_view());
}

void RealSurface::update(ExecContext& ctx, const MeshView& mesh, View<const float> dt_capture_s) {
  check_fits("vertices", mesh.positions_m.size(), settings_.max_vertices);
  check_fits("triangles", mesh.triangles.size(), settings_.max_triangles);
  if (!mesh.normals.empty() && mesh.normals.size() != mesh.positions_m.size()) {
    throw Error("real surface: " + std::to_string(mesh.normals.size()) + " normals for " +
                std::to_string(mesh.positions_m.size()) + " vertices");
  }
  ++version_;
  keep_last_frame(ctx);
  join_vertices(ctx, mesh);
  make_samples(ctx, mesh);
  if (!has_frame_) {
    ctx.parallel_for("contact/set_dt", 1, SetCaptureTime{dt_capture_s_.view(), 0});
    dt_capture_s = dt_capture_s_.const_view();
  }
  fit_motion(ctx, dt_capture_s);
  has_frame_ = true;
}

void RealSurface::keep_last_frame(ExecContext& ctx) {
  if (has_frame_) {
    ctx.parallel_for("contact/previous", kFitPoints,
                     KeepPoints{fine_.view(), component_parts_.const_view(), components_.const_view(),
                                last_components_.view(), previous_m_.view()});
    return;
  }
  ctx.fill_bytes(candidate_count_.view(), 0);
  clear(ctx);
}

void RealSurface::clear(ExecContext& ctx) {
  ++version_;
  ctx.fill_bytes(motions_.view(), 0);
  ctx.fill_bytes(measured_.view(), 0);
  ctx.fill_bytes(components_.view(), 0);
  ctx.fill_bytes(last_components_.view(), 0);
}

void RealSurface::join_vertices(ExecContext& ctx, const MeshView& mesh) {
  Count vertices = mesh.vertex_count, triangles = mesh.triangle_count;
  vertices.capacity = min(vertices.capacity, mesh.positions_m.size());
  triangles.capacity = min(triangles.capacity, mesh.triangles.size());
  ctx.parallel_for("contact/components_start", vertices,
                   ComponentStart{parent_.view(), component_samples_.view(), component_number_.view()});
  // It shortens paths for threads that wait for memory; the result is the same.
  if (ctx.device().is_cuda())
    ctx.parallel_for("contact/components_hang", triangles,
                     HangOnLowest{mesh.triangles, vertices, parent_.view()});
  ctx.parallel_for("contact/components_join", triangles,
                   JoinCorners{mesh.triangles, vertices, VertexForest{parent_.view()}});
}

/// Numbers the separate components, the largest first, and begins to sum up where each one is.
void RealSurface::find_components(ExecContext& ctx) {
  ctx.parallel_for("contact/components_count", fine_.count(),
                   CountComponentSamples{fine_.view().component, component_samples_.view(),
                                         candidates_.view(), candidate_count_.view()});
  ctx.parallel_for(
      "contact/components_choose", 1,
      ChooseComponents{component_samples_.const_view(), candidates_.const_view(), candidate_count_.view(),
                       fine_.view().count, component_number_.view(), components_.view()});
  ctx.parallel_for(
      "contact/components_number", fine_.count(),
      NumberSamples{component_number_.const_view(), components_.const_view(), fine_.components()});
  ctx.parallel_for("contact/centroid", kComponentParts,
                   ComponentPartSums{fine_.view(), components_.const_view(), component_parts_.view()});
}

void RealSurface::make_samples(ExecContext& ctx, const MeshView& mesh) {
  const Index triangles = mesh.triangles.size();
  const View<Index> cuts = cuts_.view().part(0, triangles), first = first_.view().part(0, triangles);
  Count counted = mesh.triangle_count;
  counted.capacity = min(counted.capacity, triangles);
  ctx.parallel_for("contact/cuts", counted,
                   TriangleCuts{mesh.positions_m, mesh.vertex_count, mesh.triangles, kCutEdge * spacing_m_,
                                most_cuts(settings_.max_triangles), cuts});
  ctx.exclusive_scan("contact/cuts", counted, cuts, first);
  ctx.parallel_for(
      "contact/limit", 1,
      LimitSum{cuts, first, counted, settings_.max_raw_samples, raw_count_.view(), raw_overflow_.view()});
  ctx.parallel_for("contact/triangle_samples", counted,
                   TriangleSamples{mesh.positions_m, mesh.normals, mesh.triangles, cuts, first,
                                   VertexForest{parent_.view()}, x_m_.view(), n_.view(), area_m2_.view(),
                                   root_.view(), triangle_.view()});
  fine_.build(ctx, x_m_.const_view(), n_.const_view(), area_m2_.const_view(), root_.const_view(),
              Count(raw_count_.const_view(), settings_.max_raw_samples));
  find_components(ctx);
  ctx.parallel_for("contact/triangles", Count(raw_count_.const_view(), settings_.max_raw_samples),
                   SortTriangles{mesh.positions_m, mesh.triangles, cuts, triangle_.const_view(),
                                 x_m_.const_view(), root_.const_view(), component_number_.const_view(),
                                 components_.const_view(), fine_.input_cells().order, balls_.view(),
                                 corners_.view(), triangle_component_.view(), triangle_face_.view()});
  const SamplesView fine = fine_.view();
  coarse_.build(ctx, fine.x_m, fine.n, fine.area_m2, fine.component, fine_.count());
}

void RealSurface::fit_motion(ExecContext& ctx, View<const float> dt_capture_s) {
  const float s = spacing_m_;
  const View<const SurfaceComponents> last = last_components_.const_view(), now = components_.const_view();
  ctx.parallel_for(
      "contact/match", 1,
      FitBegin{{component_parts_.const_view(), last, components_.view()},
               {motions_.const_view(), dt_capture_s, last_components_.view(), components_.view()},
               {motions_.const_view(), measured_.const_view(), dt_capture_s, last, now, fit_.view()}});
  const auto fit = [&]<class Step>(bool first, bool far, const Step& step) {
    ctx.parallel_for("contact/fit", Step::kEvaluations * kFitPoints,
                     FitPoints{previous_m_.const_view(), fine_.view(), coarse_.view(), first ? 1 : 0,
                               far ? 1 : 0, s, last, now, fit_.const_view(), fit_points_.view()});
    ctx.parallel_for("contact/fit_step", 1, FitStage<Step>{fit_points_.const_view(), last, now, step});
  };
  // First finds motions of up to 8 spacings, then fits exactly.
  fit(true, true, FirstFitStep{fit_.view()});
  fit(false, true, FitStep{fit_.view()});
  for (int i = 0; i < 3; ++i) fit(false, false, FitStep{fit_.view()});
  fit(false, false,
      ChooseMotion{fit_.view(), dt_capture_s, 0.5F * s, settings_.max_speed_m_s, now, motions_.view(),
                   measured_.view()});
  ctx.parallel_for("contact/report", kComponents,
                   NoteReport{motions_.const_view(), now, fine_.view().count, raw_overflow_.const_view(),
                              fine_.overflow(), coarse_.overflow(), report_.view()});
}

void RealSurface::archive(ExecContext& ctx, StateArchive& a) {
  for (Buffer<SurfaceComponents>* components : {&components_, &last_components_}) {
    std::vector<SurfaceComponents> all = to_host(ctx, components->const_view());
    a.values("components", all);
    a.check(all[0].count >= 0 && all[0].count <= kComponents && all[0].lost_count >= 0 &&
                all[0].lost_count <= kComponents,
            "components");
    for (const SurfaceComponent& component : all[0].component)
      a.check(component.next >= -1 && component.next < kComponents && component.samples >= 0 &&
                  component.samples <= settings_.max_samples,
              "components");
    if (!a.reads()) continue;
    ctx.upload(all, components->view());
    ctx.synchronize();
  }
  if (a.reads()) ++version_;
  a.buffer(ctx, "motions", motions_);
  std::vector<MeasuredMotions> measured = to_host(ctx, measured_.const_view());
  a.values("measured motions", measured);
  for (const MeasuredMotions& m : measured)
    a.check(m.count >= 0 && m.count <= MeasuredMotions::kMost, "measured motions");
  if (a.reads()) {
    ctx.upload(measured, measured_.view());
    ctx.synchronize();
  }
  a.buffer(ctx, "report", report_);
}

std::vector<Index> RealSurface::vertex_components(ExecContext& ctx, Index vertices) const {
  const std::vector<std::uint32_t> parent = to_host(ctx, parent_.const_view().part(0, vertices));
  std::vector<Index> component = to_host(ctx, component_number_.const_view().part(0, vertices));
  const bool mixed = to_host(ctx, components_.const_view())[0].mixed != 0;
  for (std::size_t v = 0; v < component.size(); ++v) {
    std::size_t root = v;
    while (parent[root] != root) root = parent[root];
    component[v] = mixed ? component[root] : 0;  // a root is below the others, and keeps its own number
  }
  return component;
}

RealSurfaceReport RealSurface::report(ExecContext& ctx) const {
  return to_host(ctx, report_.const_view())[0];
}

}  // namespace tactus
