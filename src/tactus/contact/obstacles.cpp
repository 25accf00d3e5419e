#include "tactus/contact/obstacles.h"

#include <algorithm>
#include <cmath>

#include "tactus/contact/body_points.h"
#include "tactus/geom/mesh/closest_point.h"
#include "tactus/geom/mesh/mesh_defects.h"

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
  const Vec3f extent_m = bounds(description.mesh).extent();
  const float longest_m = std::max({extent_m.x, extent_m.y, extent_m.z});
  TriangleMesh mesh = with_short_edges(description.mesh, 16 * spacing_m);
  const Rigidf T = description.moves ? Rigidf{} : description.T_world_obstacle;
  for (Vec3f& p : mesh.positions_m) p = T * p;
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
      throw Error("its mesh is too large for points " + number_text(double{spacing_m}) + " m apart: it is " +
                  number_text(double{longest_m}) +
                  " m long; if its file is in millimetres, say 'unit_m: 0.001'");
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

/// Blades are at most so thick where they cut: surface nearer than half of it to the edge counts as the edge.
constexpr float kEdgeThickness_m = 1e-3F;

/// From its centre, as ToolPose counts.
ObstacleDescription centered(ObstacleDescription tool) {
  const Vec3f center_m = bounds(tool.mesh).center();
  for (Vec3f& p : tool.mesh.positions_m) p -= center_m;
  for (Vec3f& p : tool.edge_m) p -= center_m;
  return tool;
}

float distance_m(const TriangleMesh& mesh, Vec3f p_m) {
  float nearest_m = 1e30F;
  for (const auto& t : mesh.triangles) {
    const auto at = [&](std::size_t k) { return mesh.positions_m[static_cast<std::size_t>(t.at(k))]; };
    nearest_m = std::min(nearest_m, length(closest_point_on_triangle(p_m, at(0), at(1), at(2)) - p_m));
  }
  return nearest_m;
}

/// Where the polyline is beside the mesh, its points are as far off as those of the mesh may be.
float edge_reach_m(const ObstacleDescription& tool) {
  float off_m = 0;
  for (const Vec3f p : tool.edge_m) off_m = std::max(off_m, distance_m(tool.mesh, p));
  return off_m + 0.5F * kEdgeThickness_m;
}

}  // namespace

Obstacles::Obstacles(ExecContext& ctx, std::span<const ObstacleDescription> descriptions,
                     float sample_spacing_m) {
  if (static_cast<Index>(descriptions.size()) > kMaxObstacles) {
    throw usage_error(std::to_string(descriptions.size()) + " obstacles, expected at most " +
                      std::to_string(kMaxObstacles));
  }
  std::vector<Obstacle> obstacles;
  for (const ObstacleDescription& description : descriptions) {
    const ObstacleDescription d = description.moves ? centered(description) : description;
    names_.push_back(d.name);
    Obstacle o;
    o.kind = d.kind;
    o.T_obstacle_world = inverse(d.T_world_obstacle);
    o.half_m = d.half_m;
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
      if (d.moves) {
        if (d.kind != ObstacleKind::mesh) throw usage_error("it moves, so it must be a mesh");
        if (tools_ == kMostTools)
          throw usage_error("expected at most " + std::to_string(kMostTools) + " that move");
        o.tool = tools_++;
        o.bounds = bounds(d.mesh);
        edges_.push_back(to_device(ctx, d.edge_m));
        o.edge_m = edges_.back().const_view();
        o.edge_reach_m = edge_reach_m(d);
      }
    } catch (const Error& e) {
      throw Error("obstacle '" + d.name + "': " + e.what(), e.kind());
    }
    obstacles.push_back(o);
  }
  if (!obstacles.empty()) obstacles_ = to_device(ctx, obstacles);
}

}  // namespace tactus
