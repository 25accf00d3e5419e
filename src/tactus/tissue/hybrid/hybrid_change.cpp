// How a solver takes a change of topology over.
#include "tactus/base/error.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tactus/tissue/topology_kernels.h"

namespace tactus {

Index Hybrid::place_of(Index node, Index layer) const {
  if (window_.places == 0) return node - window_.held.begin;
  if (node < window_.first_virtual) return node - window_.held.begin;
  const Index capacity = window_.virtual_nodes.count();
  const Index below = own_layers_.begin > held_layers_.begin ? capacity : 0;
  const Index region = layer < own_layers_.begin ? capacity : layer < own_layers_.end ? 0 : capacity + below;
  return window_.virtual_nodes.begin + region + node - window_.first_virtual;
}

LocalChange Hybrid::local(const TopologyChange& change) const {
  LocalChange here;
  const auto holds_node = [&](Index z) { return z >= held_layers_.begin && z < held_layers_.end; };
  const auto holds_cube = [&](Index z) { return z >= held_layers_.begin && z < held_layers_.end - 1; };
  const auto local_cube = [&](Index cube) {
    return cube < first_copy_ ? cube - first_cube_ : regular_cubes_ + cube - first_copy_;
  };
  for (const auto& [cube, layer] : change.cut)
    if (holds_cube(layer)) here.cut.push_back(local_cube(cube));
  for (const TopologyChange::Copy& made : change.copies) {
    if (!holds_cube(made.layer)) continue;
    cut::LocalCopy copy;
    copy.copy = made.cube - first_copy_;
    copy.parent = local_cube(made.parent);
    copy.stiffness = tled_.copy_stiffness(local_cube(made.copy.of), made.fill);
    for (int q = 0; q < 8; ++q)
      copy.nodes.node[q] = place_of(made.nodes[static_cast<std::size_t>(q)], made.layer + (q >> 2));
    here.copies.push_back(copy);
  }
  for (const TopologyChange::Node& n : change.nodes) {
    if (!holds_node(n.layer)) continue;
    here.nodes.push_back({.node = place_of(n.node, n.layer),
                          .from = n.from < 0 ? -1 : place_of(n.from, n.layer),
                          .mass_kg = n.mass_kg,
                          .fixed = n.fixed});
  }
  return here;
}

void Hybrid::apply(ExecContext& ctx, const ChangeLists& change) {
  tled_.apply(ctx, change);
  ctx.parallel_for("hybrid/set_masses", change.nodes.size(),
                   cut::SetNodeMasses{.nodes = change.nodes,
                                      .matched_mass_kg = matched_mass_kg_.const_view(),
                                      .held = held_.const_view(),
                                      .inverse_mass_per_kg = inverse_mass_per_kg_.view(),
                                      .matched_share = matched_share_.view(),
                                      .fixed = fixed_.view()});
}

void BodySolver::apply(const TopologyChange& change) {
  std::vector<LocalChange> local;
  for (auto& part : parts_) {
    if (!part->change) throw Error("a body without capacity for copies can't be cut");
    local.push_back(part->tissue.local(change));
  }
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = *parts_[p];
    ExecContext& ctx = part.ctx;
    part.change->upload(ctx, local[p]);
    part.tissue.apply(ctx, *part.change);
    const View<const cut::LocalNode> nodes = part.change->nodes;
    ctx.parallel_for(
        "hybrid/place_nodes", nodes.size(),
        cut::PlaceNodes{nodes, part.state.x_m.view(), part.state.v_m_s.view(), part.state.f_ext_N.view()});
    ctx.parallel_for("hybrid/set_held", nodes.size(), cut::SetHeldNodes{nodes, {}, part.boundary.held()});
    if (!part.held_in_cells.empty())
      ctx.parallel_for("hybrid/set_held", nodes.size(),
                       cut::SetHeldNodes{nodes, part.tissue.tled().cell(), part.held_in_cells.view()});
    ctx.parallel_for("hybrid/set_masses", nodes.size(),
                     cut::SetMasses{nodes, part.tissue.window().own.begin, part.motion.mass_kg()});
  }
  if (virtual_elements_) virtual_elements_->apply(devices_.context(0), change, parts_, body_);
  devices_.synchronize();
}

/// On the first device, which needs masses for the body's motion, owners, and the places of new nodes: the
/// frame's nodes were gathered before the cut.
void BodySolver::VirtualElementsOfAll::apply(ExecContext& ctx, const TopologyChange& change,
                                             std::span<const std::unique_ptr<Part>> parts,
                                             BodyState& gathered) {
  LocalChange nodes;
  for (const TopologyChange::Node& n : change.nodes) {
    if (n.node < first) continue;
    Index part = 0;
    while (n.layer >= parts[static_cast<std::size_t>(part)]->tissue.own_layers().end) ++part;
    owner[static_cast<std::size_t>(n.node - first)] = part;
    nodes.nodes.push_back({.node = n.node, .from = n.from, .mass_kg = n.mass_kg});
  }
  ctx.upload(std::span<const Index>(owner), device_owner.view());
  ChangeLists& lists = *parts.front()->change;
  lists.upload(ctx, nodes);
  ctx.parallel_for("hybrid/set_masses", lists.nodes.size(),
                   cut::SetMasses{lists.nodes, first, motion.mass_kg()});
  ctx.parallel_for("hybrid/place_nodes", lists.nodes.size(),
                   cut::PlaceNodes{lists.nodes, gathered.x_m.view(), gathered.v_m_s.view(), {}});
}

}  // namespace tactus
