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

BodyWalls::Part::Part(ExecContext& ctx, const WallSurface& surface, float search_reach_m, Index max_particles)
    : search(ctx.device(),
             {.max_particles = static_cast<Index>(surface.triangles.size()), .reach_m = search_reach_m}),
      triangles(to_device(ctx, surface.triangles)),
      posed(ctx.device(), static_cast<Index>(surface.vertices.size())),
      impulse(ctx.device(), posed.size()),
      middle_m(ctx.device(), triangles.size()),
      radius_m(ctx.device(), triangles.size()),
      hits(ctx.device(), max_particles) {}

BodyWalls::BodyWalls(DeviceSet& devices, int parts, const WallSurface& surface, Index owner,
                     float particle_spacing_m, Index max_particles)
    : devices_(devices),
      barrier_(devices, parts),
      nodes_(surface.nodes),
      owner_(owner),
      reach_m_(1.5F * particle_spacing_m),
      crowd_(std::max(1.F, sqr(surface.lattice_spacing_m / particle_spacing_m))),
      points_(to_device(devices.context(0), surface.vertices)) {
  ExecContext& ctx = devices.context(0);
  // No point of a triangle is farther from its middle than 0.58 edges; twice that when stretched.
  for (int p = 0; p < parts; ++p)
    parts_.emplace_back(devices.context(p), surface, reach_m_ + 1.2F * kLongestEdge * particle_spacing_m,
                        max_particles);
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

void BodyWalls::pose() {
  ExecContext& ctx = devices_.context(0);
  ctx.parallel_for(
      "body walls/vertices", points_.size(),
      PoseWallVertices{points_.const_view(), nodes_, crowd_, part(0).posed.view(), part(0).impulse.view()});
  barrier_.meet();
  for (std::size_t p = 1; p < parts_.size(); ++p) {
    ExecContext& there = devices_.context(static_cast<int>(p));
    there.parallel_for(
        "body walls/copy", points_.size(),
        CopyWallVertices{part(0).posed.const_view(), parts_[p].posed.view(), parts_[p].impulse.view()});
  }
}

void BodyWalls::find_walls(int p, const NeighbourSearch& particles, const NearWalls& near) {
  ExecContext& ctx = devices_.context(p);
  Part& here = part(p);
  ctx.parallel_for("body walls/triangles", here.triangles.size(),
                   PoseWallTriangles{here.triangles.const_view(), here.posed.const_view(),
                                     here.middle_m.view(), here.radius_m.view()});
  here.search.build(ctx, here.middle_m.const_view(), {}, here.triangles.size());
  particles.visit(ctx, "body walls/find", here.search,
                  FindBodyWalls{particles.cells().particles, here.search.cells().order,
                                here.triangles.const_view(), here.radius_m.const_view(),
                                here.posed.const_view(), owner_, reach_m_, near, here.hits.view()});
}

void BodyWalls::push(int p, const NeighbourSearch& particles, const NearWalls& near) {
  Part& here = part(p);
  devices_.context(p).parallel_for(
      "body walls/push", particles.placed(),
      PushVertices{here.hits.const_view(), here.triangles.const_view(), near, owner_, here.impulse.view()});
}

void BodyWalls::end_push() {
  ExecContext& ctx = devices_.context(0);
  barrier_.meet();
  for (std::size_t p = 1; p < parts_.size(); ++p)
    ctx.parallel_for("body walls/add", points_.size(),
                     AddWallImpulses{parts_[p].impulse.const_view(), part(0).impulse.view()});
  ctx.parallel_for("body walls/nodes", node_.size(),
                   PushNodes{node_.const_view(), first_.const_view(), incident_.const_view(),
                             points_.const_view(), part(0).impulse.const_view(), nodes_});
}

}  // namespace tactus
