#include "tactus/contact/body_walls.h"

#include <algorithm>

namespace tactus {
namespace {

/// The surface in short edges, with at least the room that it needs itself.
WallMesh mesh_of(const WallSurface& surface, float longest_m) {
  Index vertices = surface.room.vertices;
  for (const WallChange::Vertex& v : surface.all.vertices) vertices = std::max(vertices, v.vertex + 1);
  constexpr Index kAny = 1 << 30;
  WallMesh whole(longest_m, {vertices, kAny, kAny});
  whole.apply(surface.all);
  WallMesh mesh(longest_m, {vertices, static_cast<Index>(whole.added().size()) + surface.room.added,
                            static_cast<Index>(whole.triangles().size()) + surface.room.triangles});
  mesh.apply(surface.all);
  return mesh;
}

}  // namespace

BodyWalls::BodyWalls(ExecContext& ctx, const WallSurface& surface, Index owner, float particle_spacing_m,
                     Index max_particles)
    : nodes_(surface.nodes),
      owner_(owner),
      reach_m_(1.5F * particle_spacing_m),
      crowd_(std::max(1.F, sqr(surface.lattice_spacing_m / particle_spacing_m))),
      mesh_(mesh_of(surface, kLongestEdge * particle_spacing_m)),
      // No point of a triangle is farther from its middle than 2/3 of its longest edge; twice that when
      // stretched.
      search_(ctx.device(), {.max_particles = mesh_.room().triangles,
                             .reach_m = reach_m_ + 4.F / 3 * kLongestEdge * particle_spacing_m}),
      counts_(ctx.device(), 3),
      points_(ctx.device(), mesh_.room().vertices),
      added_(ctx.device(), mesh_.room().added),
      triangles_(ctx.device(), mesh_.room().triangles),
      posed_(ctx.device(), mesh_.room().vertices + mesh_.room().added),
      impulse_(ctx.device(), posed_.size()),
      node_impulse_(ctx.device(), surface.nodes.size()),
      middle_m_(ctx.device(), triangles_.size()),
      radius_m_(ctx.device(), triangles_.size()),
      hits_(ctx.device(), max_particles) {
  ctx.fill_bytes(node_impulse_.view(), 0);
  upload(ctx);
}

void BodyWalls::upload(ExecContext& ctx) {
  const auto put = [&]<class T>(const std::vector<T>& from, Buffer<T>& to) {
    const auto n = static_cast<Index>(from.size());
    if (n > 0) ctx.upload(std::span<const T>(from), to.view().part(0, n));
    return n;
  };
  const std::vector<Index> counts{put(mesh_.vertices(), points_), put(mesh_.added(), added_),
                                  put(mesh_.triangles(), triangles_)};
  ctx.upload(counts, counts_.view());
  ctx.synchronize();
}

void BodyWalls::apply(ExecContext& ctx, const WallChange& change) {
  if (change.vertices.empty() && change.triangles.empty()) return;
  mesh_.apply(change);
  upload(ctx);
}

void BodyWalls::pose(ExecContext& ctx) {
  ctx.parallel_for("body walls/vertices", count(0, points_.size()),
                   PoseWallVertices{points_.const_view(), nodes_, crowd_, posed_.view(), impulse_.view()});
  ctx.parallel_for("body walls/added", count(1, added_.size()),
                   PoseAddedVertices{added_.const_view(), points_.size(), posed_.view(), impulse_.view()});
  ctx.parallel_for(
      "body walls/triangles", count(2, triangles_.size()),
      PoseWallTriangles{triangles_.const_view(), posed_.const_view(), middle_m_.view(), radius_m_.view()});
  search_.build(ctx, middle_m_.const_view(), {}, count(2, triangles_.size()));
}

void BodyWalls::find_walls(ExecContext& ctx, const NeighbourSearch& particles, const NearWalls& near,
                           View<WallHit> hits) {
  particles.visit(ctx, "body walls/find", search_,
                  FindBodyWalls{particles.cells().particles, search_.cells().order, triangles_.const_view(),
                                radius_m_.const_view(), posed_.const_view(), owner_, reach_m_, near, hits});
}

void BodyWalls::push(ExecContext& ctx, const NeighbourSearch& particles, const NearWalls& near) {
  ctx.parallel_for("body walls/push", particles.placed(),
                   PushVertices{hits_.const_view(), triangles_.const_view(), near, owner_, impulse_.view()});
  ctx.parallel_for("body walls/push added", count(1, added_.size()),
                   PushCorners{added_.const_view(), points_.size(), impulse_.view()});
  ctx.parallel_for("body walls/gather", count(0, points_.size()),
                   GatherAtNodes{points_.const_view(), impulse_.const_view(), node_impulse_.view()});
  ctx.parallel_for("body walls/nodes", node_impulse_.size(), PushNodes{node_impulse_.view(), nodes_});
}

}  // namespace tactus
