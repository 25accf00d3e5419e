#include "contact/contact_scene.h"

#include <numeric>

namespace tactus::test {
namespace {

/// The faces of the cube [-1,1]^3 with their own vertices, mapped by f.
TriangleMesh mapped_cube(Index n, const std::function<Vec3f(Vec3f)>& f) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.F, 1.F}) {
      const auto first = static_cast<Index>(mesh.positions_m.size());
      for (Index j = 0; j <= n; ++j) {
        for (Index i = 0; i <= n; ++i) {
          Vec3f p;
          p[axis] = side;
          p[(axis + 1) % 3] = side * (2.F * static_cast<float>(i) / static_cast<float>(n) - 1.F);
          p[(axis + 2) % 3] = 2.F * static_cast<float>(j) / static_cast<float>(n) - 1.F;
          mesh.positions_m.push_back(f(p));
        }
      }
      for (Index j = 0; j < n; ++j) {
        for (Index i = 0; i < n; ++i) {
          const Index a = first + j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
          mesh.triangles.push_back({a, b, d});
          mesh.triangles.push_back({a, d, c});
        }
      }
    }
  }
  return mesh;
}

}  // namespace

TriangleMesh unit_sphere(Index n) {
  TriangleMesh mesh = mapped_cube(n, [](Vec3f p) { return normalized(p); });
  mesh.normals = mesh.positions_m;
  return mesh;
}

TriangleMesh box(Vec3f half_m, Index n) {
  return mapped_cube(n, [&](Vec3f p) { return Vec3f{half_m.x * p.x, half_m.y * p.y, half_m.z * p.z}; });
}

TriangleMesh transformed(TriangleMesh mesh, const Rigidf& T, float scale) {
  for (Vec3f& p : mesh.positions_m) p = T * (scale * p);
  for (Vec3f& n : mesh.normals) n = T.R * n;
  return mesh;
}

DeviceMesh::DeviceMesh(ExecContext& ctx, const TriangleMesh& mesh)
    : vertices(to_device(ctx, mesh.positions_m)), normals(to_device(ctx, mesh.normals)) {
  std::vector<Vec3i> t;
  for (const auto& triangle : mesh.triangles) t.push_back({triangle[0], triangle[1], triangle[2]});
  triangles = to_device(ctx, t);
}

SurfaceMeshView DeviceMesh::view() const {
  return {vertices.view(), vertices.size(), normals.view(), triangles.view(), triangles.size()};
}

RealSurfaceSettings small_surface(float spacing_m) {
  RealSurfaceSettings s;
  s.sample_spacing_m = spacing_m;
  s.max_vertices = s.max_triangles = 1 << 15;
  s.max_pieces = 1 << 15;
  s.max_samples = 1 << 13;
  return s;
}

Nodes::Nodes(std::vector<Vec3f> positions, float mass_kg, float gap_m)
    : x(std::move(positions)),
      v(x.size()),
      mass(x.size(), mass_kg),
      gap(x.size(), gap_m),
      fixed(x.size(), 0) {}

void Nodes::correct(ExecContext& ctx, Contact& contact, const RealSurface& surface, float time_s,
                    bool rescue) {
  Buffer<Vec3f> dx = to_device(ctx, x), dv = to_device(ctx, v);
  const Buffer<float> dm = to_device(ctx, mass), dg = to_device(ctx, gap);
  const Buffer<Index> df = to_device(ctx, fixed);
  std::vector<Index> all(x.size());
  std::iota(all.begin(), all.end(), 0);
  const Buffer<Index> nodes = to_device(ctx, all);
  const ContactNodes body{dx.view(), dv.view(), dm.view(), dg.view(), nodes.view(), df.view()};
  if (rescue) contact.rescue(ctx, surface, body, time_s);
  contact.correct(ctx, surface, body, time_s);
  x = to_host(ctx, dx.view());
  v = to_host(ctx, dv.view());
}

std::vector<Vec3f> block(Vec3i count, float spacing_m, Vec3f center_m) {
  std::vector<Vec3f> x;
  for (Index k = 0; k < count.z; ++k) {
    for (Index j = 0; j < count.y; ++j) {
      for (Index i = 0; i < count.x; ++i) {
        const Vec3f p = {static_cast<float>(2 * i + 1 - count.x), static_cast<float>(2 * j + 1 - count.y),
                         static_cast<float>(2 * k + 1 - count.z)};
        x.push_back(center_m + 0.5F * spacing_m * p);
      }
    }
  }
  return x;
}

}  // namespace tactus::test
