#pragma once
/// A body that is partly finite elements, partly shape matching ([P], "Hybrid deformation model").
#include <memory>
#include <optional>

#include "tactus/compute/side_stream.h"
#include "tactus/tissue/hybrid/body_model.h"
#include "tactus/tissue/lattice_part.h"
#include "tactus/tissue/topology_change.h"

namespace tactus {

/// Cubes so that nodes which only elements touch are to nodes which only shape matching touches about as a :
/// b, the elements at the low end of the axis (0 x, 1 y, 2 z); nodes of both are counted half and half.
/// @throws Error for an axis that is none of the three or shares that are negative or both zero.
ElementMask split_by_ratio(const CubeLattice& lattice, int axis, double elements, double matched);

struct BodyStep {
  float dt_s = 1e-4F;
  Vec3f gravity_m_s2{0, -9.81F, 0};
  float drag_per_s = 0;
  bool full_stiffness = false;  ///< shape matching with kappa = 1, the paper's choice
  /// So many substeps of the elements are one of shape matching, whose goals cost most: nodes that only it
  /// moves go that far at once, those of both get its pull in equal parts, so that momentum is kept. No more
  /// than Hybrid::most_matching_every, or the material is softer than it should be.
  int matching_every = 1;
  /// When given, dt_s and gravity are read from here when the kernels run: of the device that they run on.
  View<const FrameParams> frame = {};
  View<const Index> stopped = {};  ///< (1) with `frame`; != 0: the body stays where it is
  /// One: how fast the body turns as a whole, which is not damped; none: it does not.
  View<const Vec3f> spin_rad_s = {};
  Index in_block = 0;  ///< with `frame`: which substep of its block
  StepTime time() const { return {dt_s, gravity_m_s2, frame, stopped, spin_rad_s, in_block}; }
};

/// The part of a step that concerns the elements.
TledStep elements_step(const BodyStep& step);

/// Solver of one body, or of some layers of it, on one device. Between two steps, callers may change x and v
/// (contact does). Either model may be empty.
class Hybrid {
 public:
  /// @param own layers of nodes to move; absent: all. The state then holds those of window() alone.
  /// @param around so many more layers than steps read are held on each side
  /// @throws Error for materials or cubes that don't fit.
  Hybrid(ExecContext& ctx, const BodyModel& model, std::optional<Slab> own = std::nullopt, Index around = 0);

  /// So many substeps; of elements alone, whose nodes stay in cells meanwhile, other roundings than substep
  /// after substep. @throws Error when dt_s exceeds the elements' stable step, naming it.
  void step(ExecContext& ctx, BodyState& state, const BodyStep& step, int count = 1);
  /// @throws Error for a step that step() would refuse.
  void check_step(const BodyStep& step, int count) const;

  /// Substep k alone, in two pieces for a solver that exchanges nodes with other devices: goals and forces of
  /// own nodes (they read all nodes), then the own nodes move.
  void sum_forces(ExecContext& ctx, const BodyState& state, const BodyStep& step, int k);
  void move(ExecContext& ctx, BodyState& state, const BodyStep& step, int k);

  /// The most for which shape matching still has its material's stiffness, at least 1.
  int most_matching_every(float dt_s) const;

  /// Substeps that keep the elements stable (waves faster than at rest by speed_ratio) and shape matching at
  /// its material's stiffness.
  int substeps_for(float dt_frame_s, float speed_ratio = 1) const;
  float stable_step_s() const;
  /// As Tled's, of both models.
  void scale_stiffness(float scale) {
    tled_.scale_stiffness(scale);
    if (flsm_) flsm_->scale_stiffness(scale);
  }
  /// As Tled's, cubes as the body counts them; without elements nothing is found.
  void find_extremes(ExecContext& ctx, const BodyState& state);
  /// Extremes that find_extremes found, read from tled().extremes(), with cubes as the body counts them.
  tled::CubeExtremes in_body(const tled::CubeExtremes& found) const;
  Tled& tled() { return tled_; }
  const Tled& tled() const { return tled_; }
  const std::optional<Flsm>& flsm() const { return flsm_; }
  /// Nodes that the state holds, and those that move here.
  const NodeWindow& window() const { return window_; }
  /// Own nodes up to the last one that is in use.
  Count own_in_use() const {
    return has_elements_ && window_.own.count() == tled_.node_count() ? tled_.nodes_in_use()
                                                                      : window_.own.count();
  }
  /// State that it keeps from frame to frame.
  void archive(ExecContext& ctx, StateArchive& a) {
    tled_.archive(ctx, a);
    if (flsm_) flsm_->archive(ctx, a);
  }
  /// Per node here: 1: in no element.
  const Buffer<Index>& only_matched() const { return only_matched_; }
  bool has_elements() const { return has_elements_; }
  /// The part of a change that concerns this device. @throws Error for a cut through shape-matched cubes, or
  /// beyond the capacity for copies.
  LocalChange local(const TopologyChange& change) const;
  /// Between frames. Asynchronous.
  void apply(ExecContext& ctx, const ChangeLists& change);
  /// Layers of the body whose nodes move here, and those that moving them reads.
  Slab own_layers() const { return own_layers_; }
  Slab read_layers(Index around = 0) const {
    return {max(read_layers_.begin - around, held_layers_.begin),
            min(read_layers_.end + around, held_layers_.end)};
  }
  /// Where this device has a node of the body that lies in `layer`; -1: nowhere.
  Index find(Index node, Index layer) const {
    return layer >= held_layers_.begin && layer < held_layers_.end ? place_of(node, layer) : -1;
  }

 private:
  struct Layout;
  Hybrid(ExecContext& ctx, const Layout& layout, const BodyModel& model);
  void move_nodes(ExecContext& ctx, BodyState& state, const BodyStep& step, int k, Slab nodes,
                  const Count& used);

  Tled tled_;
  /// Where this device has a node of the body that lies in its layers.
  Index place_of(Index node, Index layer) const;
  NodeWindow window_;
  Slab own_layers_, read_layers_, held_layers_;    ///< of the body
  Index first_cube_, regular_cubes_, first_copy_;  ///< of the body's; of those held here; of the body
  bool has_elements_, has_rollers_;
  std::optional<Flsm> flsm_;
  std::unique_ptr<SideStream> side_stream_;  ///< where shapes are matched while elements sum forces
  Buffer<Index> matched_nodes_, matched_node_, fixed_;
  Buffer<float> matched_share_, inverse_mass_per_kg_;
  Buffer<Index> only_matched_;            ///< per node: 1: in no element
  Buffer<float> matched_mass_kg_, held_;  ///< per node, where there is capacity for a cut
};

}  // namespace tactus
