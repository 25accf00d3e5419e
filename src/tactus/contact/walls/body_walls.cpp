#include "tactus/contact/walls/body_walls.h"

#include <algorithm>

#include "tactus/contact/walls/wall_find_kernels.h"

namespace tactus {
namespace {

/// The surface in short edges, with at least the capacity that it needs itself.
WallMesh mesh_of(const WallSurface& surface, float longest_m) {
  Index vertices = surface.capacity.vertices, triangles = surface.capacity.surface;
  for (const WallChange::Vertex& v : surface.all.vertices) vertices = std::max(vertices, v.vertex + 1);
  for (const WallChange::Triangle& t : surface.all.triangles) triangles = std::max(triangles, t.triangle + 1);
  constexpr Index kAny = 1 << 30;
  WallMesh whole(longest_m, {vertices, kAny, kAny, triangles});
  whole.apply(surface.all);
  WallMesh mesh(longest_m,
                {vertices, static_cast<Index>(whole.added().size()) + surface.capacity.added,
                 static_cast<Index>(whole.triangles().size()) + surface.capacity.triangles, triangles});
  mesh.apply(surface.all);
  return mesh;
}

/// Lists of the parts of all triangles of the surface that there is capacity for.
IndexLists lists_of(ExecContext& ctx, const WallMesh& mesh, std::vector<Index> WallMesh::Parts::*which,
                    Index capacity) {
  std::vector<std::vector<Index>> lists(static_cast<std::size_t>(mesh.capacity().surface));
  for (std::size_t t = 0; t < mesh.parts().size(); ++t) lists[t] = mesh.parts()[t].*which;
  return {ctx, lists, capacity};
}

}  // namespace

BodyWalls::Part::Part(ExecContext& ctx, const WallMesh& mesh, const WallGrid& grid, Index nodes,
                      float search_reach_m, Index max_particles)
    : search(ctx.device(), {.max_particles = mesh.capacity().triangles, .reach_m = search_reach_m}),
      counts(ctx.device(), 3),
      surface(ctx.device(), mesh.capacity().surface),
      triangles(ctx.device(), mesh.capacity().triangles),
      added(ctx.device(), mesh.capacity().added),
      added_of(lists_of(ctx, mesh, &WallMesh::Parts::added, mesh.capacity().added)),
      pieces_of(lists_of(ctx, mesh, &WallMesh::Parts::triangles, mesh.capacity().triangles)),
      posed(ctx.device(), mesh.capacity().vertices + mesh.capacity().added),
      impulse(ctx.device(), posed.size()),
      active(ctx, grid, mesh.capacity(), nodes),
      marks(ctx.device(), grid.words() + WallRefresh::kCounts),
      near(ctx.device(), grid.words()),
      near_counts(ctx.device(), NearCounts::kSize),
      listed(ctx.device(), mesh.capacity().surface),
      number(ctx.device(), mesh.capacity().triangles),
      corners(ctx.device(), mesh.capacity().triangles),
      middle_m(ctx.device(), mesh.capacity().triangles),
      radius_m(ctx.device(), mesh.capacity().triangles),
      normals(ctx.device(), mesh.capacity().triangles),
      near_particles(ctx.device(), max_particles),
      hits(ctx.device(), std::int64_t{kWallSides} * max_particles) {
  ctx.fill_bytes(impulse.view(), 0);
  ctx.fill_bytes(near_counts.view(), 0);
}

BodyWalls::BodyWalls(DeviceSet& devices, int parts, const WallSurface& surface, Index collider,
                     float particle_spacing_m, Index max_particles)
    : devices_(devices),
      barrier_(devices, parts),
      nodes_(surface.nodes),
      collider_(collider),
      reach_m_(1.5F * particle_spacing_m),
      crowd_(std::max(1.F, sqr(surface.lattice_spacing_m / particle_spacing_m))),
      grid_(WallGrid::over(surface.box_m, 1.01F * reach_m_)),
      mesh_(mesh_of(surface, kLongestEdge * particle_spacing_m)),
      points_(devices.device(0), mesh_.capacity().vertices),
      node_impulse_(devices.device(0), surface.nodes.size()) {
  // No point of a triangle is farther from its middle than 2/3 of its longest edge; twice that when
  // stretched.
  const float search_reach_m = reach_m_ + 4.F / 3 * kLongestEdge * particle_spacing_m;
  for (int p = 0; p < parts; ++p)
    parts_.emplace_back(devices.context(p), mesh_, grid_, nodes_.size(), search_reach_m, max_particles);
  devices_.context(0).fill_bytes(node_impulse_.view(), 0);
  upload();
}

void BodyWalls::upload() {
  const auto put = [&]<class T>(int part, const std::vector<T>& from, Buffer<T>& to) {
    const auto n = static_cast<Index>(from.size());
    if (n > 0) devices_.context(part).upload(std::span<const T>(from), to.view().part(0, n));
    return n;
  };
  std::vector<Index> counts{put(0, mesh_.vertices(), points_), 0, 0};
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const int part = static_cast<int>(p);
    put(part, mesh_.triangles(), parts_[p].triangles);
    counts[1] = put(part, mesh_.added(), parts_[p].added);
    counts[2] = put(part, mesh_.surface(), parts_[p].surface);
    devices_.context(part).upload(counts, parts_[p].counts.view());
    parts_[p].added_of.upload(devices_.context(part));
    parts_[p].pieces_of.upload(devices_.context(part));
    if (follows())
      parts_[p].active.follow(devices_.context(part), mesh_.vertices());
    else
      parts_[p].active.take_all(devices_.context(part), counts[0], counts[2]);
  }
  devices_.synchronize();
}

void BodyWalls::apply(const WallChange& change) {
  if (change.vertices.empty() && change.triangles.empty()) return;
  mesh_.apply(change);
  for (const WallChange::Triangle& t : change.triangles) {
    if (t.triangle >= mesh_.capacity().surface) continue;
    const WallMesh::Parts& now = mesh_.parts()[at(t.triangle)];
    for (Part& part : parts_) {
      part.added_of.set(t.triangle, now.added);
      part.pieces_of.set(t.triangle, now.triangles);
    }
  }
  upload();
}

void BodyWalls::begin(const Particles& particles) {
  for (int p = 0; p < static_cast<int>(parts_.size()); ++p) find_near_cells(p, particles(p));
}

void BodyWalls::pose() {
  ExecContext& ctx = devices_.context(0);
  Part& first = parts_[0];
  if (follows()) choose_active();
  ctx.parallel_for("body walls/vertices", first.active.vertices(),
                   PoseActiveVertices{first.active.vertex_list(), pose_of(first)});
  barrier_.meet();
  copy_vertices();
  for (int p = 0; p < static_cast<int>(parts_.size()); ++p) list_triangles(p);
}

PoseWallVertices BodyWalls::pose_of(Part& first) const {
  return {points_.const_view(), nodes_, crowd_, first.posed.view(), first.impulse.view()};
}

WallRefresh BodyWalls::refresh_of(Part& part) const {
  const View<const Index> counts = part.counts.const_view();
  return {part.marks.view().part(grid_.words(), WallRefresh::kCounts), counts.part(0, 1), counts.part(2, 1),
          grid_.rows * grid_.layers, nodes_.size()};
}

void BodyWalls::find_near_cells(int part, const NeighbourSearch& particles) {
  ExecContext& ctx = devices_.context(part);
  Part& here = parts_[at(part)];
  ctx.fill_bytes(here.marks.view(), 0);
  ctx.parallel_for("body walls/mark", particles.placed(),
                   MarkCells{grid_, particles.cells().particles, here.marks.view()});
  SpreadMarks spread{grid_, here.marks.const_view(), here.near.view(), here.near_counts.view(), {}, {}};
  if (follows()) spread.guarded = here.active.guarded(), spread.refresh = refresh_of(here);
  ctx.parallel_for("body walls/spread", grid_.rows * grid_.layers, spread);
}

void BodyWalls::choose_active() {
  Part& here = parts_[0];
  const WallRefresh refresh = refresh_of(here);
  here.active.watch(devices_.context(0), nodes_, refresh);
  here.active.choose(devices_.context(0), pose_of(here), here.surface.const_view(), here.near.const_view(),
                     refresh);
}

void BodyWalls::copy_vertices() {
  for (std::size_t p = 1; p < parts_.size(); ++p) {
    Part& here = parts_[p];
    devices_.context(static_cast<int>(p))
        .parallel_for("body walls/copy", here.vertices(points_.size()),
                      CopyWallVertices{parts_[0].posed.const_view(), here.posed.view(), here.impulse.view()});
  }
}

/// The pieces of the surface that are near particles, sorted.
void BodyWalls::list_triangles(int part) {
  ExecContext& ctx = devices_.context(part);
  Part& here = parts_[at(part)];
  const View<const std::uint32_t> near = here.near.const_view();
  ctx.parallel_for("body walls/list", here.active.triangles(),
                   ListNearTriangles{grid_, near, here.active.triangle_list(), here.surface.const_view(),
                                     here.posed.const_view(), here.listed.view(), here.near_counts.view()});
  ctx.parallel_for(
      "body walls/pieces", here.listed_ones(),
      PoseNearTriangles{grid_, near, here.listed.const_view(), here.added_of.ranges(),
                        here.pieces_of.ranges(), here.added_of.values(), here.pieces_of.values(),
                        here.added.const_view(), points_.size(), here.triangles.const_view(),
                        here.posed.view(), here.near_counts.view(), here.number.view(), here.corners.view(),
                        here.middle_m.view(), here.radius_m.view(), here.normals.view()});
  here.search.build(ctx, here.middle_m.const_view(), here.number.const_view(), here.pieces());
}

NearSurface BodyWalls::Part::near_surface() const {
  return {search.cells(),       near_counts.const_view().part(NearCounts::kLargestRadius, 1),
          corners.const_view(), radius_m.const_view(),
          normals.const_view(), posed.const_view()};
}

void BodyWalls::find_walls(int part, const NeighbourSearch& particles, const NearWalls& near) {
  Part& here = parts_[at(part)];
  if (!chooses_particles()) return find_walls(part, particles, near, here.hits.view());
  ExecContext& ctx = devices_.context(part);
  const View<const SearchParticle> all = particles.cells().particles;
  ctx.parallel_for("body walls/choose", particles.placed(),
                   ChooseNearParticles{all, here.near_surface(), reach_m_, here.hits.view(),
                                       here.near_counts.view().part(NearCounts::kChosenParticles, 1),
                                       here.near_particles.view()});
  ctx.parallel_for("body walls/find", here.chosen_particles(),
                   FindBodyWalls{all, here.near_surface(), collider_, reach_m_, near, here.hits.view(),
                                 here.near_particles.const_view()});
}

void BodyWalls::find_walls(int part, const NeighbourSearch& particles, const NearWalls& near,
                           View<WallHit> hits) {
  devices_.context(part).parallel_for(
      "body walls/find", particles.placed(),
      FindBodyWalls{particles.cells().particles, parts_[at(part)].near_surface(), collider_, reach_m_, near,
                    hits});
}

void BodyWalls::push(int part, const NeighbourSearch& particles, const NearWalls& near) {
  Part& here = parts_[at(part)];
  devices_.context(part).parallel_for(
      "body walls/push", particles.placed(),
      PushVertices{here.hits.const_view(), here.corners.const_view(), near, collider_, here.impulse.view()});
}

void BodyWalls::end_push() {
  ExecContext& ctx = devices_.context(0);
  Part& first = parts_[0];
  barrier_.meet();
  for (std::size_t p = 1; p < parts_.size(); ++p) {
    const AddWallImpulses add{parts_[p].impulse.view(), 0, first.impulse.view()};
    AddWallImpulses add_added = add;
    add_added.first = points_.size();
    ctx.parallel_for("body walls/add", first.vertices(points_.size()), add);
    ctx.parallel_for("body walls/add", first.all_added(), add_added);
  }
  const PushCorners push{first.added.const_view(), points_.size(), first.impulse.view()};
  if (parts_.size() > 1)
    ctx.parallel_for("body walls/push added", first.all_added(), push);
  else
    ctx.parallel_for(
        "body walls/push added", first.listed_ones(),
        PushListedCorners{first.listed.const_view(), first.added_of.ranges(), first.added_of.values(), push});
  ctx.parallel_for("body walls/gather", first.active.vertices(),
                   GatherAtNodes{first.active.vertex_list(), points_.const_view(), first.impulse.const_view(),
                                 node_impulse_.view()});
  ctx.parallel_for("body walls/nodes", node_impulse_.size(), PushNodes{node_impulse_.view(), nodes_});
}

}  // namespace tactus
