#include "tactus/tissue/boundary/boundary.h"

namespace tactus {

Boundary::Boundary(ExecContext& ctx, const CubeLattice& lattice, const BoundaryConditions& conditions,
                   const NodeWindow& window)
    : driven_(ctx, lattice, conditions.motions, window) {
  if (!conditions.loads.empty())
    loads_ = SurfaceLoads(ctx, lattice, *conditions.surface, conditions.loads, window);
  std::vector<Index> held(static_cast<std::size_t>(window.count()));
  for (std::size_t i = 0; i < held.size(); ++i)
    held[i] = lattice.fixed[static_cast<std::size_t>(window.body_node(static_cast<Index>(i)))];
  for (const NodeMotion& motion : conditions.motions) {
    for (const Index node : motion.nodes)
      if (window.holds(node)) held[static_cast<std::size_t>(node - window.held.begin)] = kAllAxes;
  }
  held_ = to_device(ctx, held);
}

}  // namespace tactus
