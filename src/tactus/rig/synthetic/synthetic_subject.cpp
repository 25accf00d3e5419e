#include "tactus/rig/synthetic/synthetic_subject.h"

#include <tbb/parallel_for.h>

#include <cmath>

#include "tactus/base/error.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/geom/image/rasterize.h"
#include "tactus/geom/image/render_distance.h"
#include "tactus/geom/mesh/polygonize.h"
#include "tactus/rig/synthetic/figure_tracer.h"

namespace tactus {
namespace {

constexpr Vec3f kCenter_m{0, 0.5F, 0};
constexpr Index kSurfaceCells = 128;

class FigureSubject final : public SyntheticSubject {
 public:
  explicit FigureSubject(Figure figure) : figure_(std::move(figure)) {}
  Box3f bounds_m() const override { return figure_.bounds_m(); }
  void see(const Camera& camera, double time_s, BitMask& mask, DepthImage& distance_m) const override {
    const FigureShape shape = figure_.at(time_s);
    const FigureTracer tracer(camera);
    mask = BitMask(camera.width_px, camera.height_px);
    distance_m = DepthImage(camera.width_px, camera.height_px);
    tbb::parallel_for(Index{0}, tracer.strip_count(),
                      [&](Index strip) { tracer.trace_strip(shape, strip, &mask, &distance_m); });
  }
  TriangleMesh surface(double time_s) const override {
    const FigureShape shape = figure_.at(time_s);
    return polygonize(
        shape.bounds_m(), kSurfaceCells, [&](Vec3f p) { return shape.distance_m(p); }, 1);
  }
  Vec3f velocity_m_s(Vec3f p_m, double time_s) const override { return figure_.velocity_m_s(p_m, time_s); }
  double volume_m3(double time_s) const override { return figure_volume(figure_.at(time_s)).volume_m3; }

 private:
  Rigidf T_world_body(double time_s) const override { return figure_.bones(time_s).front(); }
  Figure figure_;
};

class MeshSubject final : public SyntheticSubject {
 public:
  MeshSubject(TriangleMesh mesh, double size_m, double turns_per_s)
      : mesh_(std::move(mesh)), spin_rad_s_(2 * static_cast<double>(kPi) * turns_per_s) {
    if (mesh_.triangles.empty()) throw Error("the mesh has no triangles");
    const Box3f box = bounds(mesh_);
    const Vec3f extent = box.extent(), middle = 0.5F * (box.min + box.max);
    const float scale = static_cast<float>(size_m) / max(extent.x, max(extent.y, extent.z));
    mesh_.normals.clear();
    for (Vec3f& p : mesh_.positions_m) {
      p = scale * (p - middle);
      radius_m_ = max(radius_m_, length(Vec3f{p.x, 0, p.z}));
      half_height_m_ = max(half_height_m_, abs(p.y));
    }
  }
  Box3f bounds_m() const override {
    const Vec3f half{radius_m_, half_height_m_, radius_m_};
    return {kCenter_m - half, kCenter_m + half};
  }
  void see(const Camera& camera, double time_s, BitMask& mask, DepthImage& distance_m) const override {
    const TriangleMesh mesh = surface(time_s);
    mask = render_silhouette(mesh, camera);
    distance_m = render_distance(mesh, camera);
  }
  TriangleMesh surface(double time_s) const override {
    TriangleMesh mesh = mesh_;
    const Rigidf T = T_world_body(time_s);
    for (Vec3f& p : mesh.positions_m) p = T * p;
    return mesh;
  }
  Vec3f velocity_m_s(Vec3f p_m, double) const override {
    return cross(Vec3f{0, static_cast<float>(spin_rad_s_), 0}, p_m - kCenter_m);
  }
  double volume_m3(double) const override { return tactus::volume_m3(mesh_); }

 private:
  Rigidf T_world_body(double time_s) const override {
    const auto angle = static_cast<float>(std::remainder(spin_rad_s_ * time_s, 2 * static_cast<double>(kPi)));
    return {rotation_matrix(axis_angle({0, 1, 0}, angle)), kCenter_m};
  }
  TriangleMesh mesh_;  ///< around the origin
  double spin_rad_s_;
  float radius_m_ = 0, half_height_m_ = 0;
};

}  // namespace

Rgb8 SyntheticSubject::paint(Vec3f p_m, double time_s) const {
  const Vec3f q = inverse(T_world_body(time_s)) * p_m;
  const auto band = [](float x) {
    return static_cast<std::uint8_t>(clamp(150.F + 80.F * sin_cos(20.F * x).sin, 0.F, 255.F));
  };
  return {band(q.x), band(q.y), band(q.z)};
}

std::unique_ptr<SyntheticSubject> make_figure_subject(const std::string& name, bool moving) {
  std::string plain = name;
  for (const auto& [suffix, moves] :
       {std::pair{std::string("-still"), false}, {std::string("-moving"), true}}) {
    if (!plain.ends_with(suffix)) continue;
    plain.resize(plain.size() - suffix.size());
    moving = moves;
  }
  FigureOptions options;
  options.moving = moving;
  return std::make_unique<FigureSubject>(make_figure(plain, options));
}

std::unique_ptr<SyntheticSubject> make_mesh_subject(TriangleMesh mesh, double size_m, double turns_per_s) {
  if (!(size_m > 0 && size_m <= 1))
    throw usage_error("size " + std::to_string(size_m) +
                      " m: expected above 0 to 1, the side of the workspace");
  return std::make_unique<MeshSubject>(std::move(mesh), size_m, turns_per_s);
}

}  // namespace tactus
