#include "tactus/tissue/boundary/boundary.h"

namespace tactus {

Boundary::Boundary(ExecContext& ctx, const CubeLattice& lattice, const BoundaryConditions& conditions,
                   const NodeWindow& window)
    : driven_(ctx, lattice, conditions.motions, window) {
  if (!conditions.loads.empty())
    loads_ = SurfaceLoads(ctx, lattice, *conditions.surface, conditions.loads, window);
  const auto fixed = lattice.fixed.begin() + window.held.begin;
  std::vector<Index> held(fixed, fixed + window.held.count());
  for (const NodeMotion& motion : conditions.motions) {
    for (const Index node : motion.nodes)
      if (window.owns(node)) held[static_cast<std::size_t>(node - window.held.begin)] = kAllAxes;
  }
  held_ = to_device(ctx, held);
}

}  // namespace tactus
