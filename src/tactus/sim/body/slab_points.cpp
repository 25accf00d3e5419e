#include "tactus/sim/body/slab_points.h"

#include <algorithm>

#include "tactus/base/at.h"
#include "tactus/tissue/embedded_surface.h"

namespace tactus {
namespace {

bool has_layer(Slab layers, Index layer) { return layer >= layers.begin && layer < layers.end; }

}  // namespace

/// Half a spacing apart: with whole ones, a ball pressed into a block of R / h = 8 is 2 % too soft and a
/// finger's edge may sink in between them.
BodyBoundary body_boundary(const CubeLattice& lattice, const TriangleMesh& surface,
                           const ElementMask& elements) {
  const std::vector<SpreadPoint> points = spread_points(surface, 0.5F * lattice.spacing_m);
  std::vector<Vec3f> x_m;
  for (const SpreadPoint& point : points) x_m.push_back(point.x_m);
  const std::vector<embed::Anchor> anchors = anchor_points(lattice, x_m, 1),
                                   bearing = bearing_anchors(lattice, anchors);
  std::vector<std::uint8_t> in_element(lattice.nodes.size());
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (!elements.empty() && elements[c] == 0) continue;
    for (const Index node : lattice.cube_nodes[c]) in_element[at(node)] = 1;
  }
  BodyBoundary first, others;
  const std::vector<EmbeddedPoint> embedded = embed_points(lattice, points, bearing);
  for (std::size_t p = 0; p < points.size(); ++p) {
    const EmbeddedPoint& point = embedded[p];
    bool is_first = false;
    for (int k = 0; k < 8; ++k)
      is_first = is_first || (point.weight[k] != 0 && in_element[at(point.node[k])] != 0);
    BodyBoundary& part = is_first ? first : others;
    part.points.push_back(points[p]);
    part.anchors.push_back(anchors[p]);
    part.bearing.push_back(bearing[p]);
  }
  first.first_count = static_cast<Index>(first.points.size());
  first.points.insert(first.points.end(), others.points.begin(), others.points.end());
  first.anchors.insert(first.anchors.end(), others.anchors.begin(), others.anchors.end());
  first.bearing.insert(first.bearing.end(), others.bearing.begin(), others.bearing.end());
  return first;
}

SlabPoints::SlabPoints(BodySolver& tissue, const CubeLattice& lattice, const BodyBoundary& boundary,
                       Index capacity)
    : tissue_(&tissue),
      count_(static_cast<Index>(boundary.points.size())),
      first_count_(boundary.first_count),
      others_(count_ - first_count_),
      capacity_(capacity) {
  const std::vector<EmbeddedPoint> points = embed_points(lattice, boundary.points, boundary.bearing);
  for (int s = 0; s < tissue.slab_count(); ++s) add_part(s, lattice, points);
}

/// Where a slab may have a node that a cut will add, that is its own or a copy.
std::vector<NodeShare> SlabPoints::shares(int s, const CubeLattice& lattice) const {
  const BodySolver::SlabNodes slab = tissue_->slab(s);
  std::vector<NodeShare> share(at(slab.count), NodeShare::outside);
  const auto set = [&](Index node, Index layer, NodeShare to) {
    if (const Index i = tissue_->find(s, node, layer); i >= 0) share[at(i)] = to;
  };
  for (Index node = 0; node < lattice.regular_nodes(); ++node) {
    const Index layer = lattice.nodes[at(node)].z;
    if (has_layer(slab.changed_layers, layer)) set(node, layer, NodeShare::copy);
    if (has_layer(slab.own_layers, layer)) set(node, layer, NodeShare::own);
  }
  for (Index node = lattice.regular_nodes(); node < lattice.node_count(); ++node) {
    for (const Index layer : {slab.own_layers.begin - 1, slab.own_layers.end})
      set(node, layer, NodeShare::copy);
    set(node, slab.own_layers.begin, NodeShare::own);
  }
  return share;
}

std::optional<EmbeddedPoint> SlabPoints::local(int s, const CubeLattice& lattice, EmbeddedPoint point) const {
  for (Index& node : point.node) {
    node = tissue_->find(s, node, lattice.nodes[at(node)].z);
    if (node < 0) return std::nullopt;
  }
  return point;
}

/// In the body's order, so that sums over points are grouped alike.
void SlabPoints::add_part(int s, const CubeLattice& lattice, std::span<const EmbeddedPoint> points) {
  const BodySolver::SlabNodes slab = tissue_->slab(s);
  std::vector<float> mass_kg(at(slab.count));
  for (Index node = 0; node < lattice.node_count(); ++node)
    if (const Index i = tissue_->find(s, node, lattice.nodes[at(node)].z); i >= 0)
      mass_kg[at(i)] = lattice.node_mass_kg[at(node)];
  Part& part = parts_.emplace_back();
  part.place.assign(points.size() + at(capacity_), -1);
  std::vector<EmbeddedPoint> held;
  Index first_held = 0;
  const auto add_capacity = [&] {
    part.next = static_cast<Index>(held.size());
    held.resize(held.size() + at(capacity_));
    part.reference_node.resize(held.size());
    first_held = static_cast<Index>(held.size());
  };
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (static_cast<Index>(p) == first_count_) add_capacity();
    const std::optional<EmbeddedPoint> point = local(s, lattice, points[p]);
    if (!point) continue;
    part.place[p < at(first_count_) ? p : p + at(capacity_)] = static_cast<Index>(held.size());
    held.push_back(*point);
    part.reference_node.push_back(points[p].node[0]);
  }
  if (first_count_ == count_) add_capacity();
  part.mass_kg = to_device(slab.ctx, mass_kg);
  if (capacity_ > 0) part.masses = Buffer<NodeMasses::Change>(slab.ctx.device(), lattice.node_count());
  part.points =
      BodyPoints(slab.ctx, held, slab.count, lattice.spacing_m, first_held, shares(s, lattice), capacity_);
}

void SlabPoints::apply(const TopologyChange& change, const CubeLattice& lattice,
                       std::span<const PointChange> points) {
  for (const PointChange& point : points)
    if (point.point >= first_count_ && point.point < first_count_ + capacity_)
      count_ = std::max(count_, point.point + 1 + others_);
  for (int s = 0; s < tissue_->slab_count(); ++s) {
    Part& part = parts_[at(s)];
    ExecContext& ctx = tissue_->slab(s).ctx;
    std::vector<NodeMasses::Change> masses;
    for (const TopologyChange::Node& node : change.nodes)
      if (const Index i = tissue_->find(s, node.node, node.layer); i >= 0)
        masses.push_back({i, node.mass_kg});
    const View<NodeMasses::Change> staged = part.masses.view().part(0, static_cast<Index>(masses.size()));
    ctx.upload(masses, staged);
    ctx.parallel_for("contact/set_masses", staged.size(),
                     NodeMasses{View<const NodeMasses::Change>(staged), part.mass_kg.view()});
    std::vector<PointChange> here;
    for (const PointChange& point : points) {
      const std::optional<EmbeddedPoint> to = local(s, lattice, point.to);
      if (!to) continue;
      Index& place = part.place[at(point.point)];
      if (place < 0) place = part.next++;
      part.reference_node[at(place)] = point.to.node[0];
      here.push_back({.point = place, .to = *to, .side = point.side});
    }
    part.points.apply(ctx, here);
    ctx.synchronize();
  }
}

ContactNodes SlabPoints::nodes(int slab, int k) const {
  const BodySolver::SlabNodes of = tissue_->slab(slab, k);
  return {of.x_m,  of.v_m_s,   parts_[static_cast<std::size_t>(slab)].mass_kg.const_view(),
          of.held, of.stopped, of.fields};
}

void SlabPoints::begin_frame(ContactOnDevices& world) {
  for (int s = 0; s < tissue_->slab_count(); ++s) {
    ExecContext& ctx = tissue_->slab(s).ctx;
    BodyPoints& points = parts_[static_cast<std::size_t>(s)].points;
    points.begin_frame(ctx, world.part(s).contact.frame());
    world.part(s).contact.push_out(ctx, world.part(s).surface, points, nodes(s));
  }
}

void SlabPoints::correct(ContactOnDevices& world, int k, int later_steps) {
  for (int s = 0; s < tissue_->slab_count(); ++s) {
    ContactOnDevices::Part& here = world.part(s);
    here.contact.correct(tissue_->slab(s).ctx, here.surface, here.obstacles.view(),
                         parts_[static_cast<std::size_t>(s)].points, nodes(s, k), k, later_steps);
  }
}

void SlabPoints::archive(StateArchive& a) {
  for (std::size_t s = 0; s < parts_.size(); ++s)
    parts_[s].points.archive(tissue_->slab(static_cast<int>(s)).ctx, a);
}

void SlabPoints::end_frame() {
  for (int s = 0; s < tissue_->slab_count(); ++s)
    parts_[static_cast<std::size_t>(s)].points.end_frame(tissue_->slab(s).ctx);
}

void SlabPoints::add_reports(Readback& readback) {
  for (std::size_t s = 0; s < parts_.size(); ++s)
    parts_[s].report = readback.add(parts_[s].points.totals(), static_cast<int>(s));
}

std::vector<ColliderTotals> SlabPoints::totals(const Readback& readback) const {
  std::vector<ColliderTotals> all;
  for (const Part& part : parts_) {
    const std::vector<ColliderTotals> here = readback.get<ColliderTotals>(part.report);
    if (all.empty())
      all = here;
    else
      for (std::size_t k = 0; k < all.size(); ++k) all[k].add(here[k]);
  }
  return all;
}

ContactReport SlabPoints::report(const Readback& readback, float dt_frame_s, int substeps) const {
  if (count_ == 0) return {};
  return contact_report(totals(readback), dt_frame_s, substeps);
}

std::vector<ContactPoint> SlabPoints::contacts() {
  std::vector<ContactPoint> all;
  std::array<ReactionSums, kColliders> moved_on{};
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    Part& part = parts_[s];
    std::vector<Index> point_at(at(part.points.count()), -1);  // places of the slab, by the body's points
    for (std::size_t p = 0; p < part.place.size(); ++p)
      if (part.place[p] >= 0) point_at[at(part.place[p])] = static_cast<Index>(p);
    ContactPointList here = read_contact_points(tissue_->slab(static_cast<int>(s)).ctx, part.points);
    for (ContactPoint& touching : here.points) {
      touching.point = point_at[at(touching.point)];
      all.push_back(touching);
    }
    for (std::size_t c = 0; c < moved_on.size(); ++c) moved_on[c].add(here.moved_on[c]);
  }
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.point < b.point; });
  append_moved_on(moved_on, all);
  return all;
}

std::vector<Index> SlabPoints::touched() const {
  std::vector<Index> nodes;
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    const Part& part = parts_[s];
    const std::vector<Index> touching =
        to_host(tissue_->slab(static_cast<int>(s)).ctx, part.points.touching());
    for (std::size_t p = 0; p < touching.size(); ++p)
      if (touching[p] == 1) nodes.push_back(part.reference_node[p]);
  }
  return nodes;
}

}  // namespace tactus
