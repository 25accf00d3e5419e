#include "tactus/contact/obstacles.h"

#include <algorithm>
#include <cmath>

#include "tactus/contact/body_points.h"
#include "tactus/geom/mesh_defects.h"

namespace tactus {
namespace {

/// Cuts triangles in two across their longest edge until no edge is longer; neighbours cut the same edges.
TriangleMesh with_short_edges(TriangleMesh mesh, float edge_m) {
  const auto length_of = [&](Index a, Index b) {
    return length(mesh.positions_m[static_cast<std::size_t>(a)] -
                  mesh.positions_m[static_cast<std::size_t>(b)]);
  };
  for (std::size_t t = 0; t < mesh.triangles.size();) {
    const auto v = mesh.triangles[t];
    std::size_t k = 0;
    for (std::size_t j = 1; j < 3; ++j) {
      if (length_of(v.at(j), v.at((j + 1) % 3)) > length_of(v.at(k), v.at((k + 1) % 3))) k = j;
    }
    const Index a = v.at(k), b = v.at((k + 1) % 3), c = v.at((k + 2) % 3);
    if (length_of(a, b) <= edge_m) {
      ++t;
      continue;
    }
    const auto middle = static_cast<Index>(mesh.positions_m.size());
    mesh.positions_m.push_back(0.5F * (mesh.positions_m[static_cast<std::size_t>(a)] +
                                       mesh.positions_m[static_cast<std::size_t>(b)]));
    mesh.triangles[t] = {a, middle, c};
    mesh.triangles.push_back({middle, b, c});
  }
  return mesh;
}

std::unique_ptr<RealSurface> sorted_mesh(ExecContext& ctx, const ObstacleDescription& description,
                                         float spacing_m) {
  check_closed(description.mesh, "its mesh");
  const double volume = volume_m3(description.mesh);
  if (!(volume > 0)) {
    throw Error("its mesh has a volume of " + std::to_string(volume) +
                " m^3, must be > 0: its triangles must be counter-clockwise from outside");
  }
  TriangleMesh mesh = with_short_edges(description.mesh, 16 * spacing_m);
  for (Vec3f& p : mesh.positions_m) p = description.T_world_obstacle * p;
  std::vector<Vec3i> triangles;
  Index samples = 0;
  for (const auto& t : mesh.triangles) {
    triangles.push_back({t[0], t[1], t[2]});
    float longest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      longest = std::max(longest, length(mesh.positions_m[static_cast<std::size_t>(t.at(k))] -
                                         mesh.positions_m[static_cast<std::size_t>(t.at((k + 1) % 3))]));
    }
    const auto pieces = static_cast<Index>(std::ceil(longest / spacing_m)) + 1;
    samples += pieces * pieces;
    if (samples > (1 << 23))
      throw Error("its mesh is too large for a spacing of " + std::to_string(spacing_m) + " m");
  }
  RealSurfaceSettings settings;
  settings.sample_spacing_m = spacing_m;
  settings.max_vertices = static_cast<Index>(mesh.positions_m.size());
  settings.max_triangles = static_cast<Index>(mesh.triangles.size());
  settings.max_raw_samples = settings.max_samples = samples;
  auto surface = std::make_unique<RealSurface>(ctx.device(), settings);
  const Buffer<Vec3f> vertices = to_device(ctx, mesh.positions_m);
  const Buffer<Vec3i> on_device = to_device(ctx, triangles);
  surface->update(ctx, {vertices.const_view(), on_device.const_view(), vertices.size(), on_device.size(), {}},
                  0);
  ctx.synchronize();
  return surface;
}

}  // namespace

Obstacles::Obstacles(ExecContext& ctx, std::span<const ObstacleDescription> descriptions,
                     float sample_spacing_m) {
  if (static_cast<Index>(descriptions.size()) > kMaxObstacles) {
    throw usage_error(std::to_string(descriptions.size()) + " obstacles, expected at most " +
                      std::to_string(kMaxObstacles));
  }
  std::vector<Obstacle> obstacles;
  for (const ObstacleDescription& d : descriptions) {
    names_.push_back(d.name);
    Obstacle o{d.kind, inverse(d.T_world_obstacle), d.half_m, {}};
    try {
      if (d.kind == ObstacleKind::box && !(min(d.half_m.x, min(d.half_m.y, d.half_m.z)) > 0)) {
        throw usage_error("its size is " + std::to_string(2 * d.half_m.x) + " x " +
                          std::to_string(2 * d.half_m.y) + " x " + std::to_string(2 * d.half_m.z) +
                          " m, must be > 0");
      }
      if (d.kind == ObstacleKind::mesh) {
        meshes_.push_back(sorted_mesh(ctx, d, sample_spacing_m));
        o.mesh = meshes_.back()->triangles();
      }
    } catch (const Error& e) {
      throw Error("obstacle '" + d.name + "': " + e.what(), e.kind());
    }
    obstacles.push_back(o);
  }
  if (!obstacles.empty()) obstacles_ = to_device(ctx, obstacles);
}

}  // namespace tactus
