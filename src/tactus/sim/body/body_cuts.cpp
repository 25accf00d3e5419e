#include "tactus/sim/body/body_cuts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tactus/base/at.h"
#include "tactus/sim/body/body_point.h"
#include "tactus/sim/body/body_status.h"
#include "tactus/sim/body/cut_capacity.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {
namespace {

/// Per regular cube: 1: it is an element, and no motion or load acts on its nodes.
std::vector<std::uint8_t> may_cut(const BodyShape& shape, const BodySolver& tissue) {
  const CubeLattice& lattice = shape.lattice;
  std::vector<std::uint8_t> is_driven(lattice.nodes.size()), may_cut;
  for (const NodeMotion& motion : shape.motions)
    for (const Index node : motion.nodes) is_driven[at(node)] = 1;
  for (std::size_t k = 0; k < shape.loads.size(); ++k)
    for (const Index node : tissue.boundary().loads().nodes_of(k)) is_driven[at(node)] = 1;
  for (Index c = 0; c < lattice.regular_cubes(); ++c) {
    const auto& nodes = lattice.cube_nodes[at(c)];
    const bool driven =
        std::any_of(nodes.begin(), nodes.end(), [&](Index i) { return is_driven[at(i)] != 0; });
    may_cut.push_back(shape.elements[at(c)] != 0 && !driven ? 1 : 0);
  }
  return may_cut;
}

cut::CutSurface::Capacity capacity_of(const BodyShape& shape) {
  const SurfaceCapacity capacity = surface_capacity(shape.lattice, shape.surface_m);
  return {capacity.vertices, capacity.triangles};
}

}  // namespace

BodyCuts::BodyCuts(ExecContext& ctx, const CutTargets& targets, const BodyBoundary* boundary)
    : body_(targets),
      cutter_(targets.shape.lattice, may_cut(targets.shape, targets.tissue), targets.shape.surface_m,
              to_host(ctx, targets.surface.anchors()), capacity_of(targets.shape)) {
  cutter_.take_capacity_for(change_);
  if (!targets.description.cut_capacity) cutter_.keep_spare();
  if (boundary == nullptr) return;
  const CubeLattice& lattice = targets.shape.lattice;
  points_ = cut::CutPoints(lattice, boundary->points, boundary->anchors, boundary->bearing,
                           boundary->first_count, point_capacity(lattice));
}

void BodyCuts::begin_stroke(Index stroke, int frame) {
  stroke_ = stroke;
  frame_ = frame;
}

void BodyCuts::remember_nodes() {
  last_x_m_.swap(x_m_);
  x_m_.clear();
}

/// Whether no point of the strip is in reach of the body.
bool BodyCuts::is_far(const cut::BladeStrip& strip) const {
  if (!(body_.status.motion.mass_kg > 0)) return false;
  const Vec3f low = vec_cast<float>(body_.status.motion.low_m),
              high = vec_cast<float>(body_.status.motion.high_m);
  Box3f box{strip.begin_m.front(), strip.begin_m.front()};
  for (const auto* points_m : {&strip.begin_m, &strip.end_m})
    for (const Vec3f p : *points_m) box = {min(box.min, p), max(box.max, p)};
  const Vec3f apart = max(box.min - high, low - box.max);
  return max(apart.x, max(apart.y, apart.z)) > 3 * body_.shape.lattice.spacing_m;
}

cut::CutReport BodyCuts::cut(ExecContext& ctx, std::size_t blade, const cut::BladeStrip& strip,
                             const Observer& observer) {
  cut::BladeTrail& trail = trails_[blade];
  if (is_far(strip)) {
    trail = {};
    return {};
  }
  if (x_m_.empty()) x_m_ = to_host(ctx, body_.tissue.body().x_m.const_view());
  cut::CutReport report = cutter_.cut(trail, strip, last_x_m_.empty() ? x_m_ : last_x_m_, x_m_, change_);
  const bool is_refused = report.is_full && change_.copies.empty();
  journal_origins_.resize(cutter_.lattice().journals().size(), {stroke_, frame_, is_refused ? 1 : 0});
  return take_over(ctx, report, observer);
}

cut::CutReport BodyCuts::go_on(ExecContext& ctx, const Observer& observer) {
  const cut::CutReport report = cutter_.go_on(change_);
  const bool is_refused = report.is_full && change_.copies.empty();
  if (!is_refused && !journal_origins_.empty()) journal_origins_.back().is_refused = 0;
  return take_over(ctx, report, observer);
}

/// Whoever follows the body takes over the changes of the last strip.
cut::CutReport BodyCuts::take_over(ExecContext& ctx, cut::CutReport report, const Observer& observer) {
  if (change_.copies.empty()) return report;
  do follow(ctx, change_, observer);
  while (cutter_.match_parts(change_));
  has_left_out_ = has_left_out_ || cutter_.lattice().has_left_islands() || cutter_.surface().is_full() ||
                  points_.is_full() || wounds_.is_full();
  report.is_full = report.is_full || has_left_out_;
  body_.surface.update(ctx, body_.tissue.body());
  return report;
}

void BodyCuts::follow(ExecContext& ctx, const TopologyChange& change, const Observer& observer) {
  body_.tissue.apply(change);
  body_.surface.apply(ctx, change);
  if (stroke_walls_.size() <= at(stroke_)) stroke_walls_.resize(at(stroke_) + 1);
  for (const auto& wall : cutter_.surface().new_walls()) stroke_walls_[at(stroke_)].push_back(wall.corners);
  if (wound_spacing_m_ > 0) wounds_.update(cutter_.lattice(), cutter_.surface(), change, stroke_);
  for (const TopologyChange::Vertex& v : change.vertices) wall_changes_.vertices.insert(v.vertex);
  for (const TopologyChange::Copy& copy : change.copies) wall_changes_.cubes.insert(copy.cube);
  for (const TopologyChange::Triangle& t : change.triangles) wall_changes_.triangles.insert(t.triangle);
  tactus::apply(change, body_.shape.lattice);
  for (std::vector<Vec3f>* of_nodes : {&x_m_, &last_x_m_})
    for (const TopologyChange::Node& node : change.nodes)
      if (node.from >= 0 && !of_nodes->empty()) (*of_nodes)[at(node.node)] = (*of_nodes)[at(node.from)];
  for (auto& [blade, trail] : trails_) trail.follow(change);
  std::vector<PointChange> points;
  if (body_.points.count() > 0) {
    points = points_.update(cutter_.lattice(), cutter_.surface(), change);
    body_.points.apply(change, body_.shape.lattice, points);
  }
  for (const TopologyChange::Copy& copy : change.copies)
    body_.shape.material_of_cube[at(copy.cube)] = body_.shape.material_of_cube[at(copy.copy.of)];
  if (observer) observer(change, points);
}

std::span<const std::array<Vec3d, 3>> BodyCuts::walls_of(Index stroke) const {
  if (stroke_walls_.size() <= at(stroke)) return {};
  return stroke_walls_[at(stroke)];
}

namespace {

/// Vertices of a surface, and the cubes that move them.
struct AnchoredVertices {
  std::vector<Index> vertex, cube;
  std::vector<Vec3f> local;
  void add(Index v, const embed::Anchor& anchor) {
    vertex.push_back(v);
    cube.push_back(anchor.cube);
    local.push_back(anchor.local);
  }
  std::vector<WallChange::Vertex> on(const CubeLattice& lattice) const {
    const std::vector<EmbeddedPoint> embedded =
        embed_points(lattice, std::vector<SpreadPoint>(vertex.size()), cube, local);
    std::vector<WallChange::Vertex> all;
    for (std::size_t k = 0; k < vertex.size(); ++k) {
      const Vec3f rest = vec_cast<float>(lattice.cubes[at(cube[k])]) + local[k];
      all.push_back({vertex[k], embedded[k], lattice.origin_m + lattice.spacing_m * rest});
    }
    return all;
  }
};

}  // namespace

WallChange all_walls(ExecContext& ctx, const CubeLattice& lattice, const EmbeddedSurface& surface) {
  AnchoredVertices vertices;
  Index count = 0;
  for (const embed::Anchor& anchor : to_host(ctx, surface.anchors())) vertices.add(count++, anchor);
  WallChange all{vertices.on(lattice), {}};
  for (const auto& t : surface.to_mesh(ctx).triangles)
    all.triangles.push_back({static_cast<Index>(all.triangles.size()), t});
  return all;
}

/// A vertex changes with the nodes of the cube that moves it, too.
WallChange BodyCuts::take_wall_change() {
  const WallChangeIds ids = std::exchange(wall_changes_, {});
  WallChange change;
  if (ids.vertices.empty() && ids.cubes.empty()) return change;
  const cut::CutSurface& surface = cutter_.surface();
  AnchoredVertices vertices;
  for (Index v = 0; v < surface.vertex_count(); ++v) {
    const embed::Anchor anchor = surface.anchor(cutter_.lattice(), v);
    if (ids.vertices.contains(v) || ids.cubes.contains(anchor.cube)) vertices.add(v, anchor);
  }
  change.vertices = vertices.on(body_.shape.lattice);
  for (const Index t : ids.triangles) change.triangles.push_back({t, surface.triangles()[at(t)]});
  return change;
}

std::vector<BodyCuts::VertexHeir> BodyCuts::heirs(std::span<const std::uint8_t> wanted) const {
  const IndexLists& incident = body_.surface.incident();
  const auto rest = [&](Index v) {
    const embed::Anchor anchor = cutter_.surface().anchor(cutter_.lattice(), v);
    return vec_cast<float>(body_.shape.lattice.cubes[at(anchor.cube)]) + anchor.local;
  };
  std::vector<VertexHeir> all;
  for (Index v = 0; v < static_cast<Index>(wanted.size()); ++v) {
    if (wanted[at(v)] == 0 || !incident[v].empty()) continue;
    const Vec3f p = rest(v);
    VertexHeir heir{v, -1};
    float least2 = 0;
    for (Index w = 0; w < body_.surface.vertex_count(); ++w) {
      if (incident[w].empty()) continue;
      const Vec3f d = rest(w) - p;
      if (heir.to >= 0 && dot(d, d) >= least2) continue;
      heir.to = w;
      least2 = dot(d, d);
    }
    if (heir.to >= 0) all.push_back(heir);
  }
  return all;
}

Index BodyCuts::keep_wounds(float spacing_m) {
  if (!body_.description.bleeding) return 0;
  wound_spacing_m_ = spacing_m;
  const float h = body_.shape.lattice.spacing_m;
  // A copy has a wall of some 1.2 h^2, in pieces of d^2, those at its edges in smaller ones.
  const Index capacity = static_cast<Index>(body_.shape.lattice.copies.size()) * 2 *
                         (2 + static_cast<Index>(1.5F * sqr(h / spacing_m)));
  const double d = double{spacing_m} / double{h};
  wounds_ = cut::CutWounds(d, d, capacity);
  return capacity;
}

std::vector<WoundPiece> BodyCuts::wound_pieces() const {
  const CubeLattice& lattice = body_.shape.lattice;
  const double d = double{wound_spacing_m_} / double{lattice.spacing_m};
  std::vector<WoundPiece> all;
  for (const cut::WallPiece& from : wounds_.pieces()) {
    WoundPiece& to = all.emplace_back();
    const Index regular = cutter_.lattice().regular_of(from.cube);
    const auto& nodes = lattice.cube_nodes[at(from.cube)];
    std::copy(nodes.begin(), nodes.end(), to.node);
    const Vec3d low = vec_cast<double>(lattice.cubes[at(regular)]),
                aside = std::abs(from.normal.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0},
                along = normalized(cross(aside, from.normal));
    to.local = vec_cast<float>(from.p - low);
    to.along = vec_cast<float>(along);
    to.across = vec_cast<float>(cross(from.normal, along));
    to.at_skin = wounds_.is_near_skin(from) ? 1 : 0;
    to.rim = vec_cast<float>(from.p + (from.depth + 0.5 * d) * from.skin - low);
    to.area_m2 = from.area_m2;
    if (!body_.shape.bleeding_of_cube.empty()) to.factor = body_.shape.bleeding_of_cube[at(regular)];
    to.stroke = std::min(from.stroke, kStrokes - 1);
  }
  return all;
}

void BodyCuts::follow(BodyPoint& point) const {
  const Index regular = cutter_.lattice().regular_of(point.cube);
  const Vec3d p = vec_cast<double>(body_.shape.lattice.cubes[at(regular)]) + vec_cast<double>(point.local);
  point.cube = cutter_.surface().leaf(regular, p);
  point.nodes = body_.shape.lattice.cube_nodes[at(point.cube)];
}

BodyCuts::State BodyCuts::state(ExecContext& ctx) const {
  return {cutter_.lattice().part_count(), cutter_.lattice().copies_in_use(),
          cutter_.closed_volumes_m3(to_host(ctx, body_.tissue.body().x_m.const_view()))};
}

}  // namespace tactus
