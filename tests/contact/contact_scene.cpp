#include "contact/contact_scene.h"

#include <array>
#include <map>
#include <numeric>

namespace tactus::test {
namespace {

/// The faces of the cube [-1,1]^3 mapped by f; they share the vertices of their common edges.
TriangleMesh mapped_cube(Index n, const std::function<Vec3f(Vec3f)>& f) {
  TriangleMesh mesh;
  std::map<std::array<float, 3>, Index> numbers;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.F, 1.F}) {
      std::vector<Index> grid;
      for (Index j = 0; j <= n; ++j) {
        for (Index i = 0; i <= n; ++i) {
          Vec3f p;
          p[axis] = side;
          p[(axis + 1) % 3] = side * (2.F * static_cast<float>(i) / static_cast<float>(n) - 1.F);
          p[(axis + 2) % 3] = 2.F * static_cast<float>(j) / static_cast<float>(n) - 1.F;
          const auto [known, is_new] =
              numbers.try_emplace({p.x, p.y, p.z}, static_cast<Index>(mesh.positions_m.size()));
          if (is_new) mesh.positions_m.push_back(f(p));
          grid.push_back(known->second);
        }
      }
      for (Index j = 0; j < n; ++j) {
        for (Index i = 0; i < n; ++i) {
          const auto a = static_cast<std::size_t>(j * (n + 1) + i), c = a + static_cast<std::size_t>(n) + 1;
          mesh.triangles.push_back({grid[a], grid[a + 1], grid[c + 1]});
          mesh.triangles.push_back({grid[a], grid[c + 1], grid[c]});
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

TriangleMesh together(TriangleMesh a, const TriangleMesh& b) {
  const auto first = static_cast<Index>(a.positions_m.size());
  a.positions_m.insert(a.positions_m.end(), b.positions_m.begin(), b.positions_m.end());
  a.normals.insert(a.normals.end(), b.normals.begin(), b.normals.end());
  for (const auto& t : b.triangles) a.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  return a;
}

DeviceMesh::DeviceMesh(ExecContext& ctx, const TriangleMesh& mesh)
    : vertices(to_device(ctx, mesh.positions_m)), normals(to_device(ctx, mesh.normals)) {
  std::vector<Vec3i> t;
  for (const auto& triangle : mesh.triangles) t.push_back({triangle[0], triangle[1], triangle[2]});
  triangles = to_device(ctx, t);
}

MeshView DeviceMesh::view() const {
  return {vertices.view(), triangles.view(), vertices.size(), triangles.size(), normals.view()};
}

RealSurfaceSettings small_surface(float spacing_m) {
  RealSurfaceSettings s;
  s.sample_spacing_m = spacing_m;
  s.max_vertices = s.max_triangles = 1 << 15;
  s.max_raw_samples = 1 << 15;
  s.max_samples = 1 << 13;
  return s;
}

Nodes::Nodes(std::vector<Vec3f> positions, float mass_kg)
    : x(std::move(positions)), v(x.size()), mass(x.size(), mass_kg), fixed(x.size(), 0) {}

void Nodes::make_points(ExecContext& ctx) {
  if (points.count() == static_cast<Index>(x.size())) return;
  std::vector<EmbeddedPoint> single(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    single[i] = {};
    for (Index& node : single[i].node) node = static_cast<Index>(i);
    single[i].weight[0] = 1;
  }
  points = BodyPoints(ctx, single, static_cast<Index>(x.size()), 0.005F);
}

void Nodes::begin_frame(ExecContext& ctx) {
  make_points(ctx);
  points.begin_frame(ctx);
}

ContactReport Nodes::report(ExecContext& ctx, float dt_frame_s, int substeps) {
  points.end_frame(ctx);
  return contact_report(to_host(ctx, points.totals()), dt_frame_s, substeps);
}

void Nodes::correct(ExecContext& ctx, Contact& contact, const RealSurface& surface, Index k, bool push_out,
                    View<const Obstacle> obstacles, Index later_steps) {
  make_points(ctx);
  Buffer<Vec3f> dx = to_device(ctx, x), dv = to_device(ctx, v);
  const Buffer<float> dm = to_device(ctx, mass);
  const Buffer<Index> df = to_device(ctx, fixed);
  const ContactNodes nodes{dx.view(), dv.view(), dm.const_view(), df.const_view()};
  if (push_out) contact.push_out(ctx, surface, points, nodes);
  contact.correct(ctx, surface, obstacles, points, nodes, k, later_steps);
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
