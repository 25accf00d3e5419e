#include "tactus/reconstruct/surface_pipeline.h"

#include "tactus/base/error.h"

namespace tactus {

namespace {

/// Bytes a vertex. Normals: a sum and the normal. Smoothing: four numbers and two areas for each of a
/// triangle's corners, its normals; a vertex has two triangles.
constexpr double kNormalBytes = 20, kSmoothingBytes = 160;

HullOptions with_companions(const SurfaceOptions& options) {
  HullOptions hull = options.hull;
  hull.beside_vertex_bytes += kNormalBytes + (options.smoothing_steps > 0 ? kSmoothingBytes : 0);
  return hull;
}

}  // namespace

SurfacePipeline::SurfacePipeline(DeviceSet& devices, std::span<const Camera> cameras,
                                 std::span<const Camera> depth_cameras, const SurfaceOptions& options)
    : devices_(devices),
      smoothing_steps_(options.smoothing_steps),
      hull_(devices, cameras, with_companions(options), depth_cameras),
      normals_(devices.device(0), hull_.mesh().positions_m.size()) {
  if (smoothing_steps_ < 0 || smoothing_steps_ > 100)
    throw usage_error("surface: smoothing_steps is " + std::to_string(smoothing_steps_) +
                      ", expected 0 (as it is) to 100");
  if (smoothing_steps_ > 0)
    smoothing_.emplace(devices.device(0), hull_.mesh().positions_m.size(), hull_.mesh().triangles.size());
}

std::vector<Stage> SurfacePipeline::stages(std::function<void()> upload) {
  std::vector<Stage> stages = hull_.stages([this, upload = std::move(upload)] {
    is_made_ = true;
    upload();
  });
  if (smoothing_)
    stages.push_back({.name = "surface/smooth",
                      .timed_as = "smooth",
                      .rate = Rate::capture,
                      .updates = {VisualHull::kMesh},
                      .submit = [this](BlockPlace) { smooth(); }});
  return stages;
}

void SurfacePipeline::make(std::span<const BitMask> silhouettes, std::span<const DepthImage> depths_m) {
  hull_.upload(silhouettes, depths_m);
  is_made_ = true;
  hull_.reconstruct();
  smooth();
}

void SurfacePipeline::smooth() {
  if (smoothing_) smoothing_->smooth(devices_.context(0), hull_.mesh(), voxel_size_m(), smoothing_steps_);
}

MeshView SurfacePipeline::surface() const {
  MeshView mesh = hull_.mesh();
  if (smoothing_) mesh.positions_m = smoothing_->positions_m();
  return mesh;
}

void SurfacePipeline::compute_normals() { normals_.compute(devices_.context(0), surface(), voxel_size_m()); }

MeshView SurfacePipeline::finished() {
  if (!is_made_) return {};
  compute_normals();
  const HullReport report = hull_.report();
  if (report.overflow) throw Error("the surface is incomplete: " + report.overflow->text());
  MeshView mesh = surface();
  mesh.positions_m = mesh.positions_m.part(0, report.vertices);
  mesh.triangles = mesh.triangles.part(0, report.triangles);
  mesh.normals = normals_.view().part(0, report.vertices);
  mesh.vertex_count = report.vertices;
  mesh.triangle_count = report.triangles;
  return mesh;
}

TriangleMesh SurfacePipeline::download() {
  if (!is_made_) return {};
  compute_normals();
  ExecContext& ctx = devices_.context(0);
  TriangleMesh mesh = hull_.download();
  const auto vertices = static_cast<Index>(mesh.positions_m.size());
  if (smoothing_) mesh.positions_m = to_host(ctx, smoothing_->positions_m().part(0, vertices));
  mesh.normals = to_host(ctx, normals_.view().part(0, vertices));
  return mesh;
}

}  // namespace tactus
