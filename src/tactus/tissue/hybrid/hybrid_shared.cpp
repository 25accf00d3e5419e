// Nodes of slabs that others change after each substep, as contact does.
#include <algorithm>

#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {

/// Where others find nodes that are in cells, and whether those are fixed.
void BodySolver::keep_places(const CubeLattice& lattice) {
  for (auto& part : parts_) {
    Tled& tled = part->tissue.tled();
    part->cell_of = to_host(part->ctx, tled.cell());
    std::vector<Index> held(static_cast<std::size_t>(tled.cells()));
    for (std::size_t i = 0; i < part->cell_of.size(); ++i) {
      const Index node = part->tissue.window().body_node(static_cast<Index>(i));
      held[static_cast<std::size_t>(part->cell_of[i])] = lattice.fixed[static_cast<std::size_t>(node)];
    }
    part->held_in_cells = to_device(part->ctx, held);
  }
}

BodySolver::SlabNodes BodySolver::slab(int p, int k) {
  Part& part = *parts_[static_cast<std::size_t>(p)];
  SlabNodes nodes{.ctx = part.ctx,
                  .count = part.tissue.window().count(),
                  .x_m = part.state.x_m.view(),
                  .v_m_s = part.state.v_m_s.view(),
                  .fields = {},
                  .held = part.boundary.held(),
                  .stopped = part.stopped.const_view(),
                  .own_layers = part.tissue.own_layers(),
                  .changed_layers = part.tissue.read_layers(kShared * std::max(changes_ - 1, 0))};
  if (is_changed_in_cells()) {
    nodes.count = part.tissue.tled().cells();
    nodes.fields = part.tissue.tled().fields(k + 1);
    nodes.held = part.held_in_cells.const_view();
  }
  return nodes;
}

Index BodySolver::find(int p, Index node, Index layer) const {
  const Part& part = *parts_[static_cast<std::size_t>(p)];
  const Index place = part.tissue.find(node, layer);
  return place >= 0 && is_changed_in_cells() ? part.cell_of[static_cast<std::size_t>(place)] : place;
}

/// Nodes are pulled before others change them, in all layers that changes depend on.
void BodySolver::changed_substep_in_cells(const BodyStep& step, int k) {
  if (k == 0) {
    for_each_slab([&](int p) { changed_cell_halo_->begin(p, cell_nodes(0)); });
    changed_cell_halo_->finish(cell_nodes(0));
  }
  for (int p = 0; p < slab_count(); ++p) {
    Part& part = *parts_[static_cast<std::size_t>(p)];
    const TledStep tled = elements_step(on_part(step, static_cast<std::size_t>(p), k));
    changed_cell_halo_->await_readers(p, cell_nodes(k + 1));
    part.tissue.tled().move_virtual(part.ctx, tled, k);
    part.tissue.tled().move(part.ctx, tled, k, Tled::Tiles::all);
    changed_cell_halo_->begin(p, cell_nodes(k + 1));
  }
  changed_cell_halo_->finish(cell_nodes(k + 1));
  for_each_slab([&](int p) { changed_cell_halo_->await_readers(p, cell_nodes(k + 1)); });
}

}  // namespace tactus
