#include "tactus/contact/body_walls.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "tactus/base/error.h"

namespace tactus {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Halves every edge that is too long, once. @returns whether there was one
bool halve_edges(TriangleMesh& mesh, float longest_m) {
  std::map<std::pair<Index, Index>, Index> middles;
  const auto middle = [&](Index a, Index b) -> Index {
    if (!(length(mesh.positions_m[at(a)] - mesh.positions_m[at(b)]) > longest_m)) return -1;
    const auto key = std::minmax(a, b);
    const auto known = middles.find(key);
    if (known != middles.end()) return known->second;
    const auto number = static_cast<Index>(mesh.positions_m.size());
    mesh.positions_m.push_back(0.5F * (mesh.positions_m[at(key.first)] + mesh.positions_m[at(key.second)]));
    middles.emplace(key, number);
    return number;
  };
  std::vector<std::array<Index, 3>> triangles;
  for (const auto& t : mesh.triangles) {
    const std::array<Index, 3> m{middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0])};
    const auto halved = std::count_if(m.begin(), m.end(), [](Index i) { return i >= 0; });
    if (halved == 0) {
      triangles.push_back(t);
      continue;
    }
    if (halved == 3) {
      triangles.insert(triangles.end(),
                       {{t[0], m[0], m[2]}, {m[0], t[1], m[1]}, {m[2], m[1], t[2]}, {m[0], m[1], m[2]}});
      continue;
    }
    std::size_t first = 0;  // the edge that is halved, or, of two, the one after the edge that is not
    while (!(m.at(first) >= 0 && (halved == 1 || m.at((first + 2) % 3) < 0))) ++first;
    const Index a = t.at(first), b = t.at((first + 1) % 3), c = t.at((first + 2) % 3), ab = m.at(first),
                bc = m.at((first + 1) % 3);
    if (halved == 1)
      triangles.insert(triangles.end(), {{a, ab, c}, {ab, b, c}});
    else
      triangles.insert(triangles.end(), {{ab, b, bc}, {a, ab, bc}, {a, bc, c}});
  }
  mesh.triangles = std::move(triangles);
  return !middles.empty();
}

}  // namespace

TriangleMesh with_short_edges(const TriangleMesh& mesh, float longest_m) {
  if (!(longest_m > 0))
    throw Error("short edges: they are at most " + std::to_string(longest_m) + " m, must be > 0");
  TriangleMesh fine{mesh.positions_m, {}, mesh.triangles};
  while (halve_edges(fine, longest_m)) {
  }
  return fine;
}

BodyWalls::BodyWalls(ExecContext& ctx, const WallSurface& surface, Index owner, float particle_spacing_m,
                     Index max_particles)
    : nodes_(surface.nodes),
      owner_(owner),
      reach_m_(1.5F * particle_spacing_m),
      crowd_(std::max(1.F, sqr(surface.lattice_spacing_m / particle_spacing_m))),
      // No point of a triangle is farther from its middle than 0.58 edges; twice that when stretched.
      search_(ctx.device(), {.max_particles = static_cast<Index>(surface.triangles.size()),
                             .reach_m = reach_m_ + 1.2F * kLongestEdge * particle_spacing_m}),
      points_(to_device(ctx, surface.vertices)),
      triangles_(to_device(ctx, surface.triangles)),
      posed_(ctx.device(), points_.size()),
      impulse_(ctx.device(), points_.size()),
      middle_m_(ctx.device(), triangles_.size()),
      radius_m_(ctx.device(), triangles_.size()),
      hits_(ctx.device(), max_particles) {
  std::map<Index, std::vector<Index>> incident_of;
  for (std::size_t p = 0; p < surface.vertices.size(); ++p) {
    for (Index k = 0; k < 8; ++k) {
      if (surface.vertices[p].weight[k] != 0)
        incident_of[surface.vertices[p].node[k]].push_back(8 * static_cast<Index>(p) + k);
    }
  }
  std::vector<Index> node, first{0}, incident;
  for (const auto& [n, entries] : incident_of) {
    node.push_back(n);
    incident.insert(incident.end(), entries.begin(), entries.end());
    first.push_back(static_cast<Index>(incident.size()));
  }
  node_ = to_device(ctx, node);
  first_ = to_device(ctx, first);
  incident_ = to_device(ctx, incident);
}

void BodyWalls::find_walls(ExecContext& ctx, const NeighbourSearch& particles, const NearWalls& near) {
  ctx.parallel_for("body walls/vertices", points_.size(),
                   PoseWallVertices{points_.const_view(), nodes_, crowd_, posed_.view(), impulse_.view()});
  ctx.parallel_for(
      "body walls/triangles", triangles_.size(),
      PoseWallTriangles{triangles_.const_view(), posed_.const_view(), middle_m_.view(), radius_m_.view()});
  search_.build(ctx, middle_m_.const_view(), {}, triangles_.size());
  particles.visit(
      ctx, "body walls/find", search_,
      FindBodyWalls{particles.cells().particles, search_.cells().order, triangles_.const_view(),
                    radius_m_.const_view(), posed_.const_view(), owner_, reach_m_, near, hits_.view()});
}

void BodyWalls::push(ExecContext& ctx, const NeighbourSearch& particles, const NearWalls& near) {
  ctx.parallel_for("body walls/push", particles.placed(),
                   PushVertices{hits_.const_view(), triangles_.const_view(), near, owner_, impulse_.view()});
  ctx.parallel_for("body walls/nodes", node_.size(),
                   PushNodes{node_.const_view(), first_.const_view(), incident_.const_view(),
                             points_.const_view(), impulse_.const_view(), nodes_});
}

}  // namespace tactus
