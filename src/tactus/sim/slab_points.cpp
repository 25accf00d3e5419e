#include "tactus/sim/slab_points.h"

#include <algorithm>

#include "tactus/tissue/embedded_surface.h"

namespace tactus {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

bool has(Slab layers, Index layer) { return layer >= layers.begin && layer < layers.end; }

}  // namespace

/// Half a spacing apart: with whole ones, a ball pressed into a block of R / h = 8 is 2 % too soft and a
/// finger's edge may sink in between them.
SlabPoints::SlabPoints(HybridSlabs& tissue, const CubeLattice& lattice, const TriangleMesh& surface,
                       const ElementMask& elements)
    : tissue_(&tissue) {
  std::vector<EmbeddedPoint> points = surface_points(lattice, surface, 0.5F * lattice.spacing_m);
  std::vector<std::uint8_t> in_element(lattice.nodes.size());
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (!elements.empty() && elements[c] == 0) continue;
    for (const Index node : lattice.cube_nodes[c]) in_element[at(node)] = 1;
  }
  const auto others = std::stable_partition(points.begin(), points.end(), [&](const EmbeddedPoint& p) {
    for (int k = 0; k < 8; ++k) {
      if (p.weight[k] != 0 && in_element[at(p.node[k])] != 0) return true;
    }
    return false;
  });
  count_ = static_cast<Index>(points.size());
  first_count_ = static_cast<Index>(others - points.begin());
  for (int s = 0; s < tissue.slab_count(); ++s) add_part(s, lattice, points);
}

/// In the body's order, so that sums over points are grouped alike.
void SlabPoints::add_part(int s, const CubeLattice& lattice, std::span<const EmbeddedPoint> points) {
  const HybridSlabs::SlabNodes slab = tissue_->slab(s);
  std::vector<NodeShare> share(at(slab.count), NodeShare::outside);
  std::vector<float> mass_kg(at(slab.count));
  for (Index node = 0; node < lattice.node_count(); ++node) {
    const Index layer = lattice.nodes[at(node)].z, i = tissue_->find(s, node, layer);
    if (i < 0) continue;
    if (has(slab.changed_layers, layer)) share[at(i)] = NodeShare::copy;
    if (has(slab.own_layers, layer)) share[at(i)] = NodeShare::own;
    mass_kg[at(i)] = lattice.node_mass_kg[at(node)];
  }
  std::vector<EmbeddedPoint> held;
  std::vector<Index> leader;
  Index first_held = 0;
  for (std::size_t p = 0; p < points.size(); ++p) {
    EmbeddedPoint point = points[p];
    bool is_here = true;
    for (Index& node : point.node) {
      node = tissue_->find(s, node, lattice.nodes[at(node)].z);
      is_here = is_here && node >= 0;
    }
    if (!is_here) continue;
    held.push_back(point);
    leader.push_back(points[p].node[0]);
    first_held += static_cast<Index>(p) < first_count_ ? 1 : 0;
  }
  parts_.push_back({to_device(slab.ctx, mass_kg),
                    BodyPoints(slab.ctx, held, slab.count, lattice.spacing_m, first_held, share),
                    std::move(leader),
                    {}});
}

ContactNodes SlabPoints::nodes(int slab, int k) const {
  const HybridSlabs::SlabNodes of = tissue_->slab(slab, k);
  return {of.x_m,  of.v_m_s,   parts_[static_cast<std::size_t>(slab)].mass_kg.const_view(),
          of.held, of.stopped, of.fields};
}

void SlabPoints::begin_frame(ContactOnDevices& world) {
  for (int s = 0; s < tissue_->slab_count(); ++s) {
    ExecContext& ctx = tissue_->slab(s).ctx;
    BodyPoints& points = parts_[static_cast<std::size_t>(s)].points;
    points.begin_frame(ctx);
    world.part(s).contact.rescue(ctx, world.part(s).surface, points, nodes(s));
  }
}

void SlabPoints::correct(ContactOnDevices& world, int k, int steps, PointPart part) {
  for (int s = 0; s < tissue_->slab_count(); ++s) {
    ContactOnDevices::Part& here = world.part(s);
    here.contact.correct(tissue_->slab(s).ctx, here.surface, here.obstacles.view(),
                         parts_[static_cast<std::size_t>(s)].points, nodes(s, k), k, steps, part);
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

std::vector<OwnerTotals> SlabPoints::totals(const Readback& readback) const {
  std::vector<OwnerTotals> all;
  for (const Part& part : parts_) {
    const std::vector<OwnerTotals> here = readback.get<OwnerTotals>(part.report);
    if (all.empty())
      all = here;
    else
      for (std::size_t k = 0; k < all.size(); ++k) all[k].add(here[k]);
  }
  return all;
}

std::vector<Index> SlabPoints::touched() const {
  std::vector<Index> nodes;
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    const Part& part = parts_[s];
    const std::vector<Index> touching =
        to_host(tissue_->slab(static_cast<int>(s)).ctx, part.points.touching());
    for (std::size_t p = 0; p < touching.size(); ++p)
      if (touching[p] == 1) nodes.push_back(part.leader[p]);
  }
  return nodes;
}

}  // namespace tactus
