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

BodyWalls::Part::Part(Device& device, const WallMesh::Room& room, float search_reach_m, Index max_particles)
    : search(device, {.max_particles = room.triangles, .reach_m = search_reach_m}),
      counts(device, 3),
      triangles(device, room.triangles),
      posed(device, room.vertices + room.added),
      impulse(device, posed.size()),
      middle_m(device, room.triangles),
      radius_m(device, room.triangles),
      hits(device, max_particles) {}

BodyWalls::BodyWalls(DeviceSet& devices, int parts, const WallSurface& surface, Index owner,
                     float particle_spacing_m, Index max_particles)
    : devices_(devices),
      barrier_(devices, parts),
      nodes_(surface.nodes),
      owner_(owner),
      reach_m_(1.5F * particle_spacing_m),
      crowd_(std::max(1.F, sqr(surface.lattice_spacing_m / particle_spacing_m))),
      mesh_(mesh_of(surface, kLongestEdge * particle_spacing_m)),
      points_(devices.device(0), mesh_.room().vertices),
      added_(devices.device(0), mesh_.room().added),
      node_impulse_(devices.device(0), surface.nodes.size()) {
  // No point of a triangle is farther from its middle than 2/3 of its longest edge; twice that when
  // stretched.
  const float search_reach_m = reach_m_ + 4.F / 3 * kLongestEdge * particle_spacing_m;
  for (int p = 0; p < parts; ++p)
    parts_.emplace_back(devices.device(p), mesh_.room(), search_reach_m, max_particles);
  devices_.context(0).fill_bytes(node_impulse_.view(), 0);
  upload();
}

void BodyWalls::upload() {
  const auto put = [&]<class T>(int part, const std::vector<T>& from, Buffer<T>& to) {
    const auto n = static_cast<Index>(from.size());
    if (n > 0) devices_.context(part).upload(std::span<const T>(from), to.view().part(0, n));
    return n;
  };
  const std::vector<Index> counts{put(0, mesh_.vertices(), points_), put(0, mesh_.added(), added_),
                                  static_cast<Index>(mesh_.triangles().size())};
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    put(static_cast<int>(p), mesh_.triangles(), parts_[p].triangles);
    devices_.context(static_cast<int>(p)).upload(counts, parts_[p].counts.view());
  }
  devices_.synchronize();
}

void BodyWalls::apply(const WallChange& change) {
  if (change.vertices.empty() && change.triangles.empty()) return;
  mesh_.apply(change);
  upload();
}

void BodyWalls::pose() {
  ExecContext& ctx = devices_.context(0);
  Part& first = parts_[0];
  ctx.parallel_for(
      "body walls/vertices", first.vertices(points_.size()),
      PoseWallVertices{points_.const_view(), nodes_, crowd_, first.posed.view(), first.impulse.view()});
  ctx.parallel_for(
      "body walls/added", first.added(added_.size()),
      PoseAddedVertices{added_.const_view(), points_.size(), first.posed.view(), first.impulse.view()});
  barrier_.meet();
  copy_vertices();
  sort_triangles();
}

void BodyWalls::copy_vertices() {
  const Index room = points_.size(), added = added_.size();
  for (std::size_t p = 1; p < parts_.size(); ++p) {
    ExecContext& ctx = devices_.context(static_cast<int>(p));
    Part& here = parts_[p];
    const CopyWallVertices copy{parts_[0].posed.const_view(), 0, here.posed.view(), here.impulse.view()};
    CopyWallVertices copy_added = copy;
    copy_added.first = room;
    ctx.parallel_for("body walls/copy", here.vertices(room), copy);
    ctx.parallel_for("body walls/copy", here.added(added), copy_added);
  }
}

void BodyWalls::sort_triangles() {
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    ExecContext& ctx = devices_.context(static_cast<int>(p));
    Part& here = parts_[p];
    ctx.parallel_for("body walls/triangles", here.used_triangles(),
                     PoseWallTriangles{here.triangles.const_view(), here.posed.const_view(),
                                       here.middle_m.view(), here.radius_m.view()});
    here.search.build(ctx, here.middle_m.const_view(), {}, here.used_triangles());
  }
}

void BodyWalls::find_walls(int part, const NeighbourSearch& particles, const NearWalls& near,
                           View<WallHit> hits) {
  const Part& here = parts_[at(part)];
  particles.visit(
      devices_.context(part), "body walls/find", here.search,
      FindBodyWalls{particles.cells().particles, here.search.cells().order, here.triangles.const_view(),
                    here.radius_m.const_view(), here.posed.const_view(), owner_, reach_m_, near, hits});
}

void BodyWalls::push(int part, const NeighbourSearch& particles, const NearWalls& near) {
  Part& here = parts_[at(part)];
  devices_.context(part).parallel_for(
      "body walls/push", particles.placed(),
      PushVertices{here.hits.const_view(), here.triangles.const_view(), near, owner_, here.impulse.view()});
}

void BodyWalls::end_push() {
  ExecContext& ctx = devices_.context(0);
  Part& first = parts_[0];
  barrier_.meet();
  for (std::size_t p = 1; p < parts_.size(); ++p) {
    const AddWallImpulses add{parts_[p].impulse.const_view(), 0, first.impulse.view()};
    AddWallImpulses add_added = add;
    add_added.first = points_.size();
    ctx.parallel_for("body walls/add", first.vertices(points_.size()), add);
    ctx.parallel_for("body walls/add", first.added(added_.size()), add_added);
  }
  ctx.parallel_for("body walls/push added", first.added(added_.size()),
                   PushCorners{added_.const_view(), points_.size(), first.impulse.view()});
  ctx.parallel_for("body walls/gather", first.vertices(points_.size()),
                   GatherAtNodes{points_.const_view(), first.impulse.const_view(), node_impulse_.view()});
  ctx.parallel_for("body walls/nodes", node_impulse_.size(), PushNodes{node_impulse_.view(), nodes_});
}

}  // namespace tactus
