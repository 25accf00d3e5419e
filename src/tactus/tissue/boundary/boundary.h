#pragma once
/// Motions and loads of a body between the substeps of its solver.
#include "tactus/tissue/boundary/driven_nodes.h"
#include "tactus/tissue/boundary/surface_loads.h"

namespace tactus {

struct BoundaryConditions {
  std::span<const NodeMotion> motions;
  std::span<const SurfaceLoad> loads;
  const TriangleMesh* surface = nullptr;  ///< that is loaded; absent without loads

  bool empty() const { return motions.empty() && loads.empty(); }
};

/// Those of one body, for the nodes that move on one device. A substep:
///
///   boundary.load(ctx, state, time);
///   tissue.substep(ctx, state, ..);
///   boundary.move(ctx, state, time);
class Boundary {
 public:
  /// @throws Error as DrivenNodes and SurfaceLoads.
  Boundary(ExecContext& ctx, const CubeLattice& lattice, const BoundaryConditions& conditions,
           const NodeWindow& window);

  /// Forces of the motions count from here. Asynchronous, as the next two.
  void begin_frame(ExecContext& ctx, View<const FrameParams> frame = {}) { driven_.begin_frame(ctx, frame); }
  void load(ExecContext& ctx, BodyState& state, const StepTime& time) { loads_.apply(ctx, state, time); }
  void move(ExecContext& ctx, BodyState& state, const StepTime& time) {
    driven_.move(ctx, state, held_.view(), time);
  }

  void archive(ExecContext& ctx, StateArchive& a) {
    driven_.archive(ctx, a);
    loads_.archive(ctx, a);
    a.buffer(ctx, "held nodes", held_);
  }

  const DrivenNodes& driven() const { return driven_; }
  const SurfaceLoads& loads() const { return loads_; }
  /// Per node of the state: HeldAxes, all while it is driven.
  View<const Index> held() const { return held_.const_view(); }
  View<Index> held() { return held_.view(); }

 private:
  DrivenNodes driven_;
  SurfaceLoads loads_;
  Buffer<Index> held_;
};

}  // namespace tactus
