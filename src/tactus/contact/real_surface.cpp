#include "tactus/contact/real_surface.h"

#include <string>

namespace tactus {
namespace {

// A triangle's middle is at most 2/3 of its longest edge from any of its points: 0.83 spacings.
constexpr float kPieceEdge = 1.25F;
constexpr Index kMostTriangles = 1 << 21;  // (kMaxPieces - 1)² pieces each still fit an Index

RealSurfaceSettings checked(const RealSurfaceSettings& s) {
  const auto positive = [](const char* name, double value) {
    if (!(value > 0 && value < 2e9))
      throw Error(std::string("real surface: ") + name + " is " + std::to_string(value) + ", must be > 0");
  };
  positive("sample_spacing_m", static_cast<double>(s.sample_spacing_m));
  positive("max_vertices", s.max_vertices);
  positive("max_triangles", s.max_triangles);
  positive("max_pieces", s.max_pieces);
  positive("max_samples", s.max_samples);
  positive("max_speed_m_s", static_cast<double>(s.max_speed_m_s));
  if (s.max_triangles > kMostTriangles) {
    throw Error("real surface: max_triangles is " + std::to_string(s.max_triangles) + ", at most " +
                std::to_string(kMostTriangles));
  }
  return s;
}

void check_fits(const char* what, Index have, Index room) {
  if (have > room) {
    throw Error("real surface: the mesh has room for " + std::to_string(have) + " " + what + ", max_" + what +
                " is " + std::to_string(room));
  }
}

}  // namespace

RealSurface::RealSurface(Device& device, const RealSurfaceSettings& settings)
    : settings_(checked(settings)),
      pieces_(device, settings.max_triangles + 1),
      first_(device, settings.max_triangles + 1),
      piece_count_(device, 1),
      piece_overflow_(device, 1),
      x_m_(device, settings.max_pieces),
      n_(device, settings.max_pieces),
      area_m2_(device, settings.max_pieces),
      fine_(device, settings.max_pieces, settings.max_samples, 2 * settings.sample_spacing_m, 2),
      coarse_(device, settings.max_samples, max(settings.max_samples / 4, Index(64)),
              8 * settings.sample_spacing_m, 2),
      previous_m_(device, kFitPoints),
      fit_(device, 1),
      fit_points_(device, kFitPoints),
      fit_parts_(device, kFitParts),
      motion_(device, 1) {}

void RealSurface::update(ExecContext& ctx, const SurfaceMeshView& mesh, float dt_capture_s) {
  check_fits("vertices", mesh.vertices_m.size(), settings_.max_vertices);
  check_fits("triangles", mesh.triangles.size(), settings_.max_triangles);
  if (!mesh.normals.empty() && mesh.normals.size() != mesh.vertices_m.size()) {
    throw Error("real surface: " + std::to_string(mesh.normals.size()) + " normals for " +
                std::to_string(mesh.vertices_m.size()) + " vertices");
  }
  if (has_frame_)
    ctx.parallel_for("contact/previous", kFitPoints,
                     KeepPrevious{fine_.view(), previous_m_.view(), fit_.view()});
  else
    ctx.fill_bytes(fit_.view(), 0);
  make_samples(ctx, mesh);
  fit_motion(ctx, has_frame_ ? dt_capture_s : 0.F);
  has_frame_ = true;
}

void RealSurface::make_samples(ExecContext& ctx, const SurfaceMeshView& mesh) {
  const Index triangles = mesh.triangles.size();
  const View<Index> pieces = pieces_.view().part(0, triangles + 1),
                    first = first_.view().part(0, triangles + 1);
  Count counted = mesh.triangle_count;
  counted.capacity = min(counted.capacity, triangles);
  ctx.parallel_for("contact/pieces", triangles + 1,
                   TrianglePieces{mesh.vertices_m, mesh.vertex_count, mesh.triangles, counted,
                                  kPieceEdge * settings_.sample_spacing_m, pieces});
  ctx.exclusive_scan("contact/pieces", pieces, first);
  ctx.parallel_for("contact/limit", 1,
                   LimitCount{View<const Index>(first).part(triangles, 1), settings_.max_pieces,
                              piece_count_.view(), piece_overflow_.view()});
  ctx.parallel_for("contact/triangle_samples", counted,
                   TriangleSamples{mesh.vertices_m, mesh.normals, mesh.triangles, pieces, first, x_m_.view(),
                                   n_.view(), area_m2_.view()});
  fine_.build(ctx, x_m_.const_view(), n_.const_view(), area_m2_.const_view(),
              Count(piece_count_.const_view(), settings_.max_pieces));
  const SamplesView fine = fine_.view();
  coarse_.build(ctx, fine.x_m, fine.n, fine.area_m2, fine_.count());
}

void RealSurface::fit_motion(ExecContext& ctx, float dt_capture_s) {
  const float s = settings_.sample_spacing_m;
  ctx.parallel_for("contact/centroid", kFitParts, CentroidParts{fine_.view(), fit_parts_.view()});
  ctx.parallel_for("contact/guess", 1, GuessMotion{fit_parts_.const_view(), fit_.view()});
  const auto gather = [&](const SampleLevel& level, float reach_m) {
    ctx.parallel_for(
        "contact/fit", kFitPoints,
        FitPoints{previous_m_.const_view(), level.view(), reach_m, s, fit_.const_view(), fit_points_.view()});
    ctx.parallel_for("contact/fit_parts", kFitParts, FitParts{fit_points_.const_view(), fit_parts_.view()});
  };
  gather(fine_, 2 * s);
  ctx.parallel_for("contact/fit_still", 1, NoteStill{fit_parts_.const_view(), fit_.view()});
  gather(fine_, 2 * s);
  ctx.parallel_for("contact/fit_guess", 1, NoteGuess{fit_parts_.const_view(), fit_.view()});
  for (int i = 0; i < 5; ++i) {
    const bool far = i < 2;  // first what is 8 spacings off, then exactly
    gather(far ? coarse_ : fine_, (far ? 8.F : 2.F) * s);
    ctx.parallel_for("contact/fit_step", 1, FitStep{fit_parts_.const_view(), fit_.view()});
  }
  gather(fine_, 2 * s);
  ctx.parallel_for("contact/motion", 1,
                   ChooseMotion{fit_parts_.const_view(), fit_.const_view(), dt_capture_s, 0.5F * s,
                                settings_.max_speed_m_s, motion_.view()});
}

RealSurfaceReport RealSurface::report(ExecContext& ctx) const {
  RealSurfaceReport report;
  report.samples = to_host(ctx, fine_.view().count)[0];
  report.dropped_pieces = to_host(ctx, piece_overflow_.const_view())[0];
  report.dropped_samples = to_host(ctx, fine_.overflow())[0] + to_host(ctx, coarse_.overflow())[0];
  report.motion = to_host(ctx, motion_.const_view())[0];
  return report;
}

}  // namespace tactus
